"""Patches of a raster are numbered as SciPy numbers them."""

import numpy as np
from scipy import ndimage

from touchline.services.planner.coverage.kernels.patch_labels import label_patches


def test_patches_are_those_of_scipy() -> None:
    chance = np.random.default_rng(3)
    for share in (0.0, 0.2, 0.4, 0.6, 1.0):
        cells = chance.random((37, 53)) < share
        assert np.array_equal(label_patches(cells), ndimage.label(cells, np.ones((3, 3)))[0])

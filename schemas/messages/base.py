"""The base of every message model, and the ROS 2 field types."""

from typing import Annotated, Any, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer

_Number = TypeVar("_Number", np.float64, np.float32, np.int64, np.uint8, np.bool_)

UInt8 = Annotated[int, Field(ge=0, le=2**8 - 1)]
Int8 = Annotated[int, Field(ge=-(2**7), le=2**7 - 1)]
UInt16 = Annotated[int, Field(ge=0, le=2**16 - 1)]
Int32 = Annotated[int, Field(ge=-(2**31), le=2**31 - 1)]
Int64 = Annotated[int, Field(ge=-(2**63), le=2**63 - 1)]
UInt32 = Annotated[int, Field(ge=0, le=2**32 - 1)]
UInt64 = Annotated[int, Field(ge=0, le=2**64 - 1)]


def _checked(array: npt.NDArray[_Number]) -> npt.NDArray[_Number]:
    """One-dimensional and read-only: a message never changes after it is made."""
    if array.ndim != 1:
        raise ValueError(f"needs one dimension, has {array.ndim}")
    array.flags.writeable = False
    return array


def _float_array(value: object) -> npt.NDArray[np.float64]:
    return _checked(np.array(value, dtype=np.float64))


def _float32_array(value: object) -> npt.NDArray[np.float32]:
    return _checked(np.array(value, dtype=np.float32))


def _int64_array(value: object) -> npt.NDArray[np.int64]:
    return _checked(np.array(value, dtype=np.int64))


def _uint8_array(value: object) -> npt.NDArray[np.uint8]:
    return _checked(np.array(value, dtype=np.uint8))


def _bool_array(value: object) -> npt.NDArray[np.bool_]:
    return _checked(np.array(value, dtype=np.bool_))


def _list(array: npt.NDArray[Any]) -> list[float]:
    return [float(value) for value in array]


def _exact_list(array: npt.NDArray[Any]) -> list[Any]:
    return list(array.tolist())


Float64Array = Annotated[npt.NDArray[np.float64], BeforeValidator(_float_array), PlainSerializer(_list)]
Float32Array = Annotated[npt.NDArray[np.float32], BeforeValidator(_float32_array), PlainSerializer(_list)]
Int64Array = Annotated[npt.NDArray[np.int64], BeforeValidator(_int64_array), PlainSerializer(_exact_list)]
UInt8Array = Annotated[npt.NDArray[np.uint8], BeforeValidator(_uint8_array), PlainSerializer(_exact_list)]
BoolArray = Annotated[npt.NDArray[np.bool_], BeforeValidator(_bool_array), PlainSerializer(_exact_list)]


def zeros(length: int) -> npt.NDArray[np.float64]:
    """A read-only zero array of ``length``, the default of fixed-size array fields."""
    return _float_array(np.zeros(length))


def _equal(left: object, right: object) -> bool:
    if isinstance(left, np.ndarray) and isinstance(right, np.ndarray):
        return left.dtype == right.dtype and np.array_equal(left, right, equal_nan=True)
    if isinstance(left, float) and isinstance(right, float):
        return left == right or (left != left and right != right)
    return bool(left == right)


class Message(BaseModel):
    """A ROS 2 message: frozen, no unknown fields, equal when every field is (NaN equals NaN)."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        arbitrary_types_allowed=True,
        from_attributes=True,
        defer_build=True,  # no process uses more than a part of them, and building all takes longer than its start
    )
    ros_type: ClassVar[str] = ""

    def __eq__(self, other: object) -> bool:
        """Field-wise equality; pydantic's own cannot compare arrays."""
        if type(self) is not type(other):
            return NotImplemented
        return all(_equal(getattr(self, name), getattr(other, name)) for name in type(self).model_fields)

    __hash__ = None  # type: ignore[assignment]

"""Ten drawings that are as hard as the ones that people have: 24 by 24 units, meant for a scale of half a metre."""

import math

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" stroke="black">'


def _wreath() -> str:
    """A hundred small Bézier curves, rounded to two digits, so that their joints turn by a few degrees."""
    points = [
        ((10 + math.sin(5 * a)) * math.cos(a) + 12, (10 + math.sin(5 * a)) * math.sin(a) + 12)
        for a in (2 * math.pi * k / 300 for k in range(300))
    ]
    text = [f"M{points[0][0]:.2f} {points[0][1]:.2f}"]
    for k in range(0, 300, 3):
        p, q, r, s = (points[(k + j) % 300] for j in range(4))
        first = [(-5 * p[i] + 18 * q[i] - 9 * r[i] + 2 * s[i]) / 6 for i in (0, 1)]
        second = [(2 * p[i] - 9 * q[i] + 18 * r[i] - 5 * s[i]) / 6 for i in (0, 1)]
        text.append("C" + " ".join(f"{v:.2f}" for v in (*first, *second, *s)))
    return f'<path d="{"".join(text)}Z"/>'


def _flattened() -> str:
    """A circle and a spiral of short lines."""
    ring = " ".join(f"{6 + 5 * math.cos(k / 50):.3f},{6 + 5 * math.sin(k / 50):.3f}" for k in range(314))
    spiral = " ".join(
        f"{16 + k / 120 * math.cos(k / 20):.3f},{16 + k / 120 * math.sin(k / 20):.3f}" for k in range(600)
    )
    return f'<polygon points="{ring}"/><polyline fill="none" stroke="red" points="{spiral}"/>'


TEN = {
    "nearly straight arcs": '<path d="M1 1A40000 40000 0 0 1 21 1.0005L21 9A1e7 1e7 0 0 0 1 9.001z"/>',
    "hundreds of curves": _wreath(),
    "slivers": '<path d="M1 4h20v.05h-20z M2 9C8 7 14 11 21 9L21 9.04C14 11.04 8 7.04 2 9.04z M5 15h9l.03.03v6"/>',
    "dots": '<circle cx="3" cy="3" r=".1"/><path d="M8 3h.15v.12h-.15z M2 8h20"/><circle cx="14" cy="3" r=".004"/>',
    "touching itself": '<path d="M2 2L20 20H2L20 2C14 8 9 8 2 2z M3 21C9 25 9 15 15 21S21 17 15 21"/>',
    "tiny gaps": '<path fill="none" stroke="red" d="M2 2H20V10H2V2.03 M4 14c9 0 9 7 16 7l.002.001c0-4-3-6-6-7"/>',
    "letters": (
        '<path d="M2 21V3h1.2l5 9.9 5-9.9h1.2v18h-.9V4.9L8.7 14.5h-1L2.9 4.9V21z M16 21v-.3l1-.1V4.4l-1-.1V4h4.9c3 0 3 '
        '6.5 0 6.7 3.2.1 3.9 10.3-.6 10.3z M17.9 10.2h2.5c2.2 0 2.2-5.4 0-5.4h-2.5z"/>'
    ),
    "nested": (
        '<defs><g id="leaf"><path id="one" d="M0 0C2-1 4-1 5 0 4 1 2 1 0 0"/></g><g id="pair"><use xlink:href="#leaf"/>'
        '<use href="#leaf" transform="rotate(60) scale(1 -.8)"/></g></defs><g transform="translate(12 12) skewX(10)">'
        '<use href="#pair"/><use href="#pair" transform="matrix(-1 0 0 1 -1 0)"/></g><circle r="3" '
        'transform="translate(12 4) scale(-1 1)"/>'
    ),
    "holes and repeats": (
        '<path fill-rule="evenodd" d="M1 1h14v14h-14z M4 4v8h8v-8z"/><path d="M1 1v14h14v-14z"/>'
        '<path d="M17 2a3 3 0 1 0 6 0a3 3 0 1 0-6 0z"/><path d="M17 17a3.001 3 0 0 1 6 0a3 3.001 0 0 1-6 0z"/>'
    ),
    "flattened curves": _flattened(),
}

"""What every registered pair is checked with: near-singular samples, and its distance in extended precision.

Geometries are those of the kernels, (N, 8) rows of [point, direction, length, 0]. Nothing here is taken from the
kernels: distances are other formulas, derivatives are differences. A new pair needs one entry in `CASES`.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from primitives.vectors import PARALLEL

Array = NDArray[Any]
Long = NDArray[Any]
"""In extended precision; functions that only do arithmetic take both."""
Sample = tuple[Array, Array]
Distance = Callable[[Array, Array], Long]

EXTENDED = np.finfo(np.longdouble).eps < 1e-18
"""Whether this machine's long double has more digits than its double; the differences below need them."""


class Case(NamedTuple):
    """How a pair is sampled and what its distance is.

    Attributes
    ----------
    sample : (rng, n, smallest) -> geometries outside the declared band, distances (or angles) from `smallest` to 1.
    distance : (a, b) -> (N,), smooth near the sample.
    bend : (a, b) -> (N,) the motion, in m and rad, over which the gradient changes; differences take a fraction of it.
    absolute : the pair's distance is the absolute value of `distance`.
    kinks : as `sample`, where the second derivative jumps: a closest point just at an end of its segment.
    several : as `sample`, where more than one pair of points is closest.
    band : as `sample`, inside the declared band; with the distance that the pair's docstring names for it.
    """

    sample: Callable[[Generator, int, float], Sample]
    distance: Distance
    bend: Distance
    absolute: bool = False
    kinks: Callable[[Generator, int], Sample] | None = None
    several: Callable[[Generator, int], Sample] | None = None
    band: tuple[Callable[[Generator, int], Sample], Distance] | None = None


def norm(v: Long) -> Long:
    return np.asarray(np.sqrt((v * v).sum(-1)))


def inner(u: Long, v: Long) -> Long:
    return np.asarray((u * v).sum(-1))


def parts(a: Array) -> tuple[Long, Long, Long]:
    """Points, unit directions and lengths, in extended precision."""
    e = a.astype(np.longdouble)
    size = norm(e[:, 3:6])
    return e[:, :3], e[:, 3:6] / np.where(size > 0, size, 1)[:, None], e[:, 6]


def sine(a: Array, b: Array) -> Long:
    return norm(np.cross(parts(a)[1], parts(b)[1]))


def point_to_point(a: Array, b: Array) -> Long:
    return norm(parts(a)[0] - parts(b)[0])


def point_to_plane(a: Array, b: Array) -> Long:
    return inner(parts(a)[0] - parts(b)[0], parts(b)[1])


def point_to_line(a: Array, b: Array) -> Long:
    w, l = parts(a)[0] - parts(b)[0], parts(b)[1]
    return norm(w - inner(w, l)[:, None] * l)


def line_to_point(a: Array, b: Array) -> Long:
    return point_to_line(b, a)


def point_to_segment(a: Array, b: Array) -> Long:
    (p, l, length), t = parts(b), parts(a)[0]
    return norm(t - p - np.clip(inner(t - p, l), 0, length)[:, None] * l)


def line_to_line(a: Array, b: Array) -> Long:
    """Signed: smooth where the lines meet."""
    n = np.cross(parts(a)[1], parts(b)[1])
    return inner(parts(a)[0] - parts(b)[0], n) / norm(n)


def parallel_line_to_line(a: Array, b: Array) -> Long:
    """|l_a x m_b + m_a x l_b|, by a x (b x c) = b (a.c) - c (a.b)."""
    (p, l, _), (r, k, _) = parts(a), parts(b)
    return norm((r - p) * inner(l, k)[:, None] - k * inner(l, r)[:, None] + l * inner(p, k)[:, None])


def angle(a: Array, b: Array) -> Long:
    """W. Kahan's, accurate at every angle."""
    l, k = parts(a)[1], parts(b)[1]
    return 2 * np.arctan2(norm(l - k), norm(l + k))


def segment_to_segment(a: Array, b: Array) -> Long:
    """The least of the distances of the four ends, and that of the closest points of the lines, moved inside."""
    (p, l, length), (r, k, reach) = parts(a), parts(b)
    w, c = r - p, inner(l, k)
    with np.errstate(all="ignore"):
        s = (inner(w, l) - c * inner(w, k)) / norm(np.cross(l, k)) ** 2
    s = np.clip(np.nan_to_num(s), 0, length)
    t = np.clip(s * c - inner(w, k), 0, reach)
    s = np.clip(t * c + inner(w, l), 0, length)
    start, end, first, last = (e.astype(np.longdouble) for e in (a, a, b, b))
    end[:, :3] = p + length[:, None] * l
    last[:, :3] = r + reach[:, None] * k
    ends = [point_to_segment(start, b), point_to_segment(end, b), point_to_segment(first, a), point_to_segment(last, a)]
    return np.minimum.reduce([*ends, norm(p + s[:, None] * l - r - t[:, None] * k)])


def units(rng: Generator, n: int) -> Array:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def perpendicular(rng: Generator, l: Array) -> Array:
    """A unit vector perpendicular to each l, at random about it."""
    v = np.cross(l, units(rng, len(l)))
    return v / np.linalg.norm(v, axis=1)[:, None]


def log_uniform(rng: Generator, n: int, low: float, high: float) -> Array:
    return np.exp(rng.uniform(np.log(low), np.log(high), n))


def geometry(point: Array, direction: Array | None = None, length: Array | float = 0.0) -> Array:
    out = np.zeros((len(point), 8))
    out[:, :3] = point
    if direction is not None:
        out[:, 3:6] = direction / np.linalg.norm(direction, axis=1)[:, None]
    out[:, 6] = length
    return out


def sample_points(rng: Generator, n: int, smallest: float) -> Sample:
    p = rng.uniform(-0.7, 0.7, (n, 3))
    return geometry(p), geometry(p + log_uniform(rng, n, smallest, 1.0)[:, None] * units(rng, n))


def sample_point_plane(rng: Generator, n: int, smallest: float) -> Sample:
    """On both sides, and one in ten on the plane itself."""
    p, normal = rng.uniform(-0.7, 0.7, (n, 3)), units(rng, n)
    height = log_uniform(rng, n, smallest, 1.0) * rng.choice([-1.0, 1.0], n) * (rng.random(n) > 0.1)
    across = perpendicular(rng, normal) * rng.uniform(0.0, 1.0, n)[:, None]
    return geometry(p), geometry(p - height[:, None] * normal - across, normal)


def sample_point_line(rng: Generator, n: int, smallest: float) -> Sample:
    p, l = rng.uniform(-0.7, 0.7, (n, 3)), units(rng, n)
    t = p + log_uniform(rng, n, smallest, 1.0)[:, None] * perpendicular(rng, l)
    return geometry(t), geometry(p - rng.uniform(-1.0, 1.0, n)[:, None] * l, l)


def sample_line_point(rng: Generator, n: int, smallest: float) -> Sample:
    a, b = sample_point_line(rng, n, smallest)
    return b, a


def sample_point_segment(rng: Generator, n: int, smallest: float) -> Sample:
    """Nearest an inner point, the start or the end."""
    start, l, length = rng.uniform(-0.7, 0.7, (n, 3)), units(rng, n), log_uniform(rng, n, 0.05, 1.0)
    where = rng.choice([0.0, 0.5, 1.0], n)
    foot = np.where(where == 0.5, rng.uniform(0.1, 0.9, n), where)[:, None] * length[:, None] * l
    lean = np.where(where == 0.5, 0.0, np.sign(where - 0.5) * rng.uniform(0.1, 1.0, n))[:, None]
    u = lean * l + np.sqrt(1.0 - lean**2) * perpendicular(rng, l)
    return geometry(start + foot + log_uniform(rng, n, smallest, 1.0)[:, None] * u), geometry(start, l, length)


def kinks_point_segment(rng: Generator, n: int) -> Sample:
    """Just beside an end: inner points and the end are equally near."""
    start, l, length = rng.uniform(-0.7, 0.7, (n, 3)), units(rng, n), log_uniform(rng, n, 0.05, 1.0)
    foot = start + (rng.choice([0.0, 1.0], n) * length)[:, None] * l
    return geometry(foot + log_uniform(rng, n, 1e-2, 1.0)[:, None] * perpendicular(rng, l)), geometry(start, l, length)


def angles(rng: Generator, n: int, smallest: float) -> Array:
    """From `smallest` to pi minus it, dense at both ends."""
    phi = log_uniform(rng, n, smallest, np.pi / 2)
    return np.where(rng.random(n) < 0.5, phi, np.pi - phi)


def two_directions(rng: Generator, phi: Array) -> tuple[Array, Array, Array]:
    """Directions at an angle, and their common normal; exactly parallel where phi is 0, or pi to the last digit."""
    l = units(rng, len(phi))
    across = perpendicular(rng, l)
    small = np.where(phi > 3.0, np.pi - phi, phi)
    k = np.cos(small)[:, None] * l + np.sin(small)[:, None] * across
    k[small < 1e-16] = l[small < 1e-16]
    return l, np.where(phi > 3.0, -1.0, 1.0)[:, None] * k, np.cross(l, across)


OUTSIDE = 1.0001 * PARALLEL
"""Just outside the declared band of near-parallel lines."""


def lines_at(rng: Generator, phi: Array, d: Array) -> Sample:
    """Lines at an angle and a distance, their closest points near the origins or, for one in two, 1/angle away."""
    n = len(phi)
    l, k, normal = two_directions(rng, phi)
    s, t = rng.uniform(-1.0, 1.0, (2, n))
    far = rng.random(n) < 0.5
    s = np.where(far, s / np.maximum(np.sin(phi), 1e-5), s)
    t = np.where(far, s * np.sign(np.cos(phi)), t)
    p = rng.uniform(-0.7, 0.7, (n, 3))
    return geometry(p, l), geometry(p + s[:, None] * l + d[:, None] * normal - t[:, None] * k, k)


def sample_lines(rng: Generator, n: int, smallest: float) -> Sample:
    """Near parallel, near anti-parallel, near intersecting, and all at once."""
    return lines_at(rng, angles(rng, n, OUTSIDE), log_uniform(rng, n, smallest, 1.0))


def sample_line_angles(rng: Generator, n: int, smallest: float) -> Sample:
    """Angles near 0 and pi; the distance does not matter and may be 0."""
    return lines_at(rng, angles(rng, n, smallest), rng.choice([0.0, 0.3], n))


def parallel_lines(rng: Generator, n: int) -> Sample:
    """Inside the declared band: exactly parallel and anti-parallel, and tilted by up to PARALLEL."""
    phi = log_uniform(rng, n, 1e-15, 0.999 * PARALLEL) * (rng.random(n) < 0.7)
    phi = np.where(rng.random(n) < 0.5, phi, np.pi - phi)
    l, k, _ = two_directions(rng, phi)
    p, across = rng.uniform(-0.7, 0.7, (n, 3)), perpendicular(rng, l)
    d, along = log_uniform(rng, n, 1e-3, 1.0), rng.uniform(-1.0, 1.0, n)
    return geometry(p, l), geometry(p + d[:, None] * across + along[:, None] * l, k)


def segments_at(rng: Generator, phi: Array, d: Array, margin: float) -> Sample:
    """Segments whose closest points are two inner points, an end and an inner point, or two ends.

    `margin` is the least cosine between the line of closest points and a segment that is met at an end; at 0, the
    closest inner point of its line just is that end.
    """
    n = len(phi)
    l, k, normal = two_directions(rng, phi)
    length, reach = log_uniform(rng, n, 0.05, 1.0), log_uniform(rng, n, 0.05, 1.0)
    kind = rng.integers(0, 4, n) if margin else rng.integers(1, 3, n)  # inner-inner, end-inner, inner-end, end-end
    # u from b to a is the common normal; or perpendicular to the segment that is met inside; or anything for two ends.
    u = normal * rng.choice([-1.0, 1.0], n)[:, None]
    cosine = rng.choice([-1.0, 1.0], n) * rng.uniform(margin, 1.0 if margin else 0.0, n)
    for met, which in ((k, 1), (l, 2)):
        tilted = cosine[:, None] * np.cross(met, normal) + np.sqrt(1.0 - cosine**2)[:, None] * u
        u = np.where((kind == which)[:, None], tilted, u)
    while (again := (kind == 3) & ~((np.abs(inner(u, l)) > margin) & (np.abs(inner(u, k)) > margin))).any():
        u[again] = units(rng, int(again.sum()))
    inner_s, inner_t = rng.uniform(0.2, 0.8, (2, n))
    rising_s, rising_t = inner(u, l), -inner(u, k)  # of the distance along each segment: it is met where it starts
    s = np.where(np.isin(kind, (0, 2)), inner_s, rising_s < 0.0) * length
    t = np.where(np.isin(kind, (0, 1)), inner_t, rising_t < 0.0) * reach
    p = rng.uniform(-0.7, 0.7, (n, 3))
    return geometry(p, l, length), geometry(p + s[:, None] * l - d[:, None] * u - t[:, None] * k, k, reach)


def sample_segments(rng: Generator, n: int, smallest: float) -> Sample:
    return segments_at(rng, angles(rng, n, OUTSIDE), log_uniform(rng, n, smallest, 1.0), 0.1)


def kinks_segments(rng: Generator, n: int) -> Sample:
    return segments_at(rng, angles(rng, n, 0.1), log_uniform(rng, n, 1e-2, 1.0), 0.0)


def parallel_segments(rng: Generator, n: int) -> Sample:
    """Exactly parallel or tilted by up to PARALLEL, overlapping by a part of the shorter one."""
    phi = log_uniform(rng, n, 1e-17, PARALLEL) * (rng.random(n) < 0.7)
    phi = np.where(rng.random(n) < 0.5, phi, np.pi - phi)
    l, k, _ = two_directions(rng, phi)
    length, reach = log_uniform(rng, n, 0.05, 1.0), log_uniform(rng, n, 0.05, 1.0)
    p, d = rng.uniform(-0.7, 0.7, (n, 3)), log_uniform(rng, n, 1e-3, 1.0)
    s, t = rng.uniform(0.1, 0.9, (2, n)) * (length, reach)
    across = perpendicular(rng, l)
    b = p + s[:, None] * l + d[:, None] * across - t[:, None] * k
    return geometry(p, l, length), geometry(b, k, reach)


def line_bend(a: Array, b: Array) -> Long:
    """A turn by a part of the angle phi between the lines already changes the gradient by d/phi."""
    return sine(a, b) / 4


def parallel_bend(a: Array, b: Array) -> Long:
    return parallel_line_to_line(a, b) / 4


def point_segment_bend(a: Array, b: Array) -> Long:
    return np.minimum(point_to_segment(a, b), 0.1 * b[:, 6])


def segment_bend(a: Array, b: Array) -> Long:
    """The closest inner points of lines at an angle phi move by d/phi^2 per radian, and may not leave the segments."""
    d, phi = segment_to_segment(a, b), sine(a, b)
    return np.minimum.reduce([d, phi, 0.2 * np.minimum(a[:, 6], b[:, 6]) * phi * np.minimum(1.0, phi / d)])


CASES: dict[str, Case] = {
    "point_point": Case(sample_points, point_to_point, point_to_point),
    "point_plane": Case(sample_point_plane, point_to_plane, lambda a, b: np.ones(len(a), dtype=np.longdouble)),
    "line_point": Case(sample_line_point, line_to_point, line_to_point),
    "point_line": Case(sample_point_line, point_to_line, point_to_line),
    "point_segment": Case(sample_point_segment, point_to_segment, point_segment_bend, kinks=kinks_point_segment),
    "line_line": Case(
        sample_lines, line_to_line, line_bend, absolute=True, band=(parallel_lines, parallel_line_to_line)
    ),
    "line_line_angle": Case(sample_line_angles, angle, sine),
    "segment_segment": Case(
        sample_segments, segment_to_segment, segment_bend, kinks=kinks_segments, several=parallel_segments
    ),
}
"""By the pair's name."""


LATTICE = np.array(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3)).reshape(3, -1).T


def degenerate(rng: Generator, n: int, kinds: tuple[str, str]) -> Sample:
    """Elements on a coarse lattice, so that contact, overlap, parallels and shared ends are common, not rare.

    About half of them are exactly there, the others off by 1e-320 to 1e-6.
    """
    out: list[Array] = []
    axes = LATTICE[np.abs(LATTICE).sum(1) > 0]
    for kind in kinds:
        point, direction = 0.1 * LATTICE[rng.integers(0, 27, n)], axes[rng.integers(0, 26, n)]
        if out and np.any(out[0][:, 3:6]):
            same = rng.random(n) < 0.3
            direction[same] = (rng.choice([-1.0, 1.0], (n, 1)) * out[0][:, 3:6])[same]
        for row in (point, direction):
            by = np.exp(rng.uniform(np.log(1e-320), np.log(1e-6), (n, 1)))
            row += np.where(rng.random((n, 1)) < 0.25, by * rng.normal(size=(n, 3)), 0.0)
        length = rng.choice([1e-9, 0.1, 0.2, 0.1 * np.sqrt(2.0)], n)
        out.append(geometry(point, None if kind == "point" else direction, length if kind == "segment" else 0.0))
    return out[0], out[1]

"""Collapses edges of tetrahedra and moves their nodes, one after the other, as machine code.

All of it is in one file: Numba's cache of a function does not notice that one in another file has changed.
"""

from typing import no_type_check

import numba
import numpy as np

__all__ = ["MOST", "collapse_edges", "improve_nodes"]

MOST = 96  # tetrahedra around a node
TURN = 0.3  # least cosine between a triangle of the surface and that in its place

compiled = numba.njit(cache=True, nogil=True, error_model="numpy")


@compiled
@no_type_check
def _quality(a, b, c, d):
    """Volume relative to the edges' lengths: 1 for a regular tetrahedron, negative if inside out."""
    u, v, w = b - a, c - a, d - a
    volume = np.dot(u, np.cross(v, w)) / 6.0
    p, q, r = c - b, d - b, d - c
    squares = np.dot(u, u) + np.dot(v, v) + np.dot(w, w) + np.dot(p, p) + np.dot(q, q) + np.dot(r, r)
    return 6.0 * np.sqrt(2.0) * volume / (squares / 6.0) ** 1.5


@compiled
@no_type_check
def _value(values, origin, cell, point):
    """A function that is known on a grid, between its corners."""
    at = (point - origin) / cell
    i = min(max(int(at[0]), 0), values.shape[0] - 2)
    j = min(max(int(at[1]), 0), values.shape[1] - 2)
    k = min(max(int(at[2]), 0), values.shape[2] - 2)
    x, y, z = at[0] - i, at[1] - j, at[2] - k
    total = 0.0
    for a in range(2):
        for b in range(2):
            for c in range(2):
                weight = (x if a else 1.0 - x) * (y if b else 1.0 - y) * (z if c else 1.0 - z)
                total += weight * values[i + a, j + b, k + c]
    return total


@compiled
@no_type_check
def _to_triangle(p, a, b, c):
    """Distance of a point from a triangle (Ericson 2005, Real-time collision detection, 5.1.5)."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = np.dot(ab, ap), np.dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return np.sqrt(np.dot(ap, ap))
    bp, cp = p - b, p - c
    d3, d4, d5, d6 = np.dot(ab, bp), np.dot(ac, bp), np.dot(ab, cp), np.dot(ac, cp)
    if d3 >= 0.0 and d4 <= d3:
        return np.sqrt(np.dot(bp, bp))
    if d6 >= 0.0 and d5 <= d6:
        return np.sqrt(np.dot(cp, cp))
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        away = ap - d1 / (d1 - d3) * ab
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        away = ap - d2 / (d2 - d6) * ac
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        away = bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)
    else:
        away = ap - (vb * ab + vc * ac) / (va + vb + vc)
    return np.sqrt(np.dot(away, away))


@compiled
@no_type_check
def _rim(tetrahedra, around, count, node, rim):
    """Finds the sides of the surface at a node, as their other two corners in order; returns how many there are."""
    sides = np.empty((3 * count, 2), dtype=np.int64)
    for at in range(count):
        t = tetrahedra[around[at]]
        for c in range(4):
            if t[c] == node:
                # the other corners, counter-clockwise seen from the node's side of an outward triangle
                if c == 0:
                    x, y, z = t[1], t[2], t[3]
                elif c == 1:
                    x, y, z = t[0], t[3], t[2]
                elif c == 2:
                    x, y, z = t[0], t[1], t[3]
                else:
                    x, y, z = t[0], t[2], t[1]
        sides[3 * at, 0], sides[3 * at, 1] = y, x
        sides[3 * at + 1, 0], sides[3 * at + 1, 1] = z, y
        sides[3 * at + 2, 0], sides[3 * at + 2, 1] = x, z
    found = 0
    for one in range(3 * count):
        single = True
        for other in range(3 * count):
            if sides[other, 0] == sides[one, 1] and sides[other, 1] == sides[one, 0]:
                single = False
                break
        if single:
            rim[found] = sides[one]
            found += 1
    return found


@compiled
@no_type_check
def _joined(tetrahedra, around, counts, u, v):
    """Whether what touches both nodes of an edge is more than what is around the edge: then a collapse would pinch."""
    for at in range(counts[u]):
        t = tetrahedra[around[u, at]]
        if (t == v).any():
            continue
        for w in t:
            if w == u:
                continue
            touches = False
            for more in range(counts[v]):
                if (tetrahedra[around[v, more]] == w).any():
                    touches = True
                    break
            if not touches:
                continue
            between = False
            for more in range(counts[u]):
                s = tetrahedra[around[u, more]]
                if (s == v).any() and (s == w).any():
                    between = True
                    break
            if not between:
                return True
    return False


@compiled
@no_type_check
def _keeps_surface(points, rim, count, u, v, field, tolerance):
    """Whether the surface stays in place, and as smooth, when a node `u` of it goes to `v`."""
    values, origin, cell = field
    nearest, ends = np.inf, 0
    for at in range(count):
        a, b = rim[at, 0], rim[at, 1]
        if v in (a, b):
            ends += 1
            continue
        x, y = points[a], points[b]
        before, after = np.cross(x - points[u], y - points[u]), np.cross(x - points[v], y - points[v])
        if np.dot(before, after) < TURN * np.sqrt(np.dot(before, before) * np.dot(after, after)):
            return False
        off = abs(_value(values, origin, cell, (x + y + points[v]) / 3.0))
        off = max(off, abs(_value(values, origin, cell, 0.5 * (x + points[v]))))
        if max(off, abs(_value(values, origin, cell, 0.5 * (y + points[v])))) > tolerance:
            return False
        nearest = min(nearest, _to_triangle(points[u], points[v], x, y))
    return ends == 2 and nearest < tolerance


@compiled
@no_type_check
def _may_go(points, tetrahedra, around, counts, outer, u, v, field, tolerance, quality, longest, rim):
    if outer[u] and not outer[v]:
        return False
    if counts[u] + counts[v] > MOST:
        return False
    corners = np.empty((4, 3))
    for at in range(counts[u]):
        t = tetrahedra[around[u, at]]
        if (t == v).any():
            continue
        for corner in range(4):
            corners[corner] = points[v if t[corner] == u else t[corner]]
        if _quality(corners[0], corners[1], corners[2], corners[3]) < quality:
            return False
        for node in t:
            if node != u:
                away = points[node] - points[v]
                if np.dot(away, away) > longest * longest:
                    return False
    if not outer[u]:
        return True
    count = _rim(tetrahedra, around[u], counts[u], u, rim)
    return _keeps_surface(points, rim, count, u, v, field, tolerance) and not _joined(tetrahedra, around, counts, u, v)


@compiled
@no_type_check
def _drop(around, counts, node, tetrahedron):
    for at in range(counts[node]):
        if around[node, at] == tetrahedron:
            counts[node] -= 1
            around[node, at] = around[node, counts[node]]
            return


@compiled
@no_type_check
def collapse_edges(points, tetrahedra, alive, around, counts, outer, edges, field, limits, spare):
    """Collapses `edges` (E, 2) in that order, where that is sound, until `spare` nodes are gone; returns how many went.

    `limits` are the surface's tolerance, the least quality, and the longest edge. `tetrahedra` (M, 4), `alive` (M,),
    and the numbers of tetrahedra `around` each node (N, MOST) with their `counts` (N,) are changed in place.
    """
    tolerance, quality, longest = limits
    rim = np.empty((3 * MOST, 2), dtype=np.int64)
    gone = 0
    for at in range(len(edges)):
        for end in range(2):
            u, v = edges[at, end], edges[at, 1 - end]
            if counts[u] == 0 or counts[v] == 0:
                break
            if _may_go(points, tetrahedra, around, counts, outer, u, v, field, tolerance, quality, longest, rim):
                for one in range(counts[u]):
                    number = around[u, one]
                    t = tetrahedra[number]
                    if (t == v).any():
                        alive[number] = False
                        for node in t:
                            if node != u:
                                _drop(around, counts, node, number)
                    else:
                        for corner in range(4):
                            if t[corner] == u:
                                t[corner] = v
                        around[v, counts[v]] = number
                        counts[v] += 1
                counts[u] = 0
                gone += 1
                break
        if gone >= spare:
            break
    return gone


@compiled
@no_type_check
def _worst(points, tetrahedra, around, count):
    worst = np.inf
    for at in range(count):
        t = tetrahedra[around[at]]
        worst = min(worst, _quality(points[t[0]], points[t[1]], points[t[2]], points[t[3]]))
    return worst


@compiled
@no_type_check
def improve_nodes(points, tetrahedra, around, counts, outer, field, good, steps):
    """Moves nodes whose worst tetrahedron is worse than `good` to where that is best; those of the surface along it.

    They are tried at `steps` (S, 3), relative to the shortest edge. `points` (N, 3) are changed in place."""
    values, origin, cell = field
    for node in range(len(points)):
        if counts[node] == 0:
            continue
        best = _worst(points, tetrahedra, around[node], counts[node])
        if best >= good:
            continue
        here, size = points[node].copy(), np.inf
        for at in range(counts[node]):
            for other in tetrahedra[around[node, at]]:
                if other != node:
                    away = points[other] - here
                    size = min(size, np.sqrt(np.dot(away, away)))
        off = abs(_value(values, origin, cell, here)) if outer[node] else np.inf
        found = here.copy()
        for step in steps:
            points[node] = here + size * step
            if outer[node] and abs(_value(values, origin, cell, points[node])) > off + 0.02 * size:
                continue
            worst = _worst(points, tetrahedra, around[node], counts[node])
            if worst > best:
                best, found = worst, points[node].copy()
        points[node] = found

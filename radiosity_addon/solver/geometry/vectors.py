"""Vectors, most of them as columns (3, n): NumPy's inner loops then run over points, not over three
numbers."""

from __future__ import annotations

import numpy as np


def columns(vectors: np.ndarray) -> np.ndarray:
    """(3, n) contiguous of vectors (n, 3)."""
    return np.ascontiguousarray(vectors.T)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(...) products of vectors (3, ...)."""
    result = a[0] * b[0]
    result = result + a[1] * b[1]
    result += a[2] * b[2]
    return result


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(3, ...) products of vectors (3, ...)."""
    result = np.empty_like(a)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(a[i], b[j], out=result[k])
        result[k] -= a[j] * b[i]
    return result


def unit_rows(rows: np.ndarray) -> np.ndarray:
    """(..., 3) of vectors (..., 3) the directions, of length 1; 0 of those that are 0."""
    length = np.linalg.norm(rows, axis=-1, keepdims=True)
    return rows / np.where(length > 0, length, 1)


def row_squares(rows: np.ndarray) -> np.ndarray:
    """(n,) sums of the squares in each row of (n, c)."""
    return np.einsum("ij,ij->i", rows, rows)


def lengths(a: np.ndarray) -> np.ndarray:
    """(...) lengths of vectors (3, ...), never 0."""
    return np.sqrt(np.maximum(dot(a, a), 1e-30))


def tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two vectors (3, ...) across unit ``normal`` (3, ...) and each other. Branchless construction
    of Duff et al. 2017, "Building an Orthonormal Basis, Revisited", Listing 3."""
    x, y, z = normal
    dtype = normal.dtype.type
    sign = np.copysign(dtype(1), z + dtype(1 / 3))  # not at 0: walls stand there
    a = -1 / (sign + z)
    b = x * y * a
    tangent, bitangent = np.empty_like(normal), np.empty_like(normal)
    tangent[0] = 1 + sign * x * x * a
    tangent[1], tangent[2] = sign * b, -sign * x
    bitangent[0], bitangent[1], bitangent[2] = b, sign + y * y * a, -y
    return tangent, bitangent

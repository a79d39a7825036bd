"""Modes 1 and 2 of meshopt compression: triangles and sequences of indices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Bytes

TABLE = 16  # bytes at a triangle stream's end


def triangles(stream: Bytes, count: int) -> NDArray[np.uint32]:
    """Decode mode 1 into (count,) indices. Raises ValueError or IndexError for a broken stream."""
    if count % 3 or len(stream) < 1 + count // 3 + TABLE or stream[0] != 0xE1:
        raise ValueError("it is no stream of triangles")
    codes, data = stream[1 : 1 + count // 3].tolist(), stream[1 + count // 3 :].tolist()
    return np.array(_Triangles(data).decoded(codes), np.uint32)


def sequence(stream: Bytes, count: int) -> NDArray[np.uint32]:
    """Decode mode 2 into (count,) indices. Raises ValueError for a broken stream."""
    if len(stream) < 1 + count + 4 or stream[0] != 0xD1:
        raise ValueError("it is no stream of indices")
    body = stream[1:-4]
    ends = np.flatnonzero(body < 128)[:count]
    if len(ends) < count:
        raise ValueError("it is cut short")
    begins = np.concatenate([[0], ends[:-1] + 1])
    if (ends - begins).max() > 4:
        raise ValueError("a number has more than five bytes")
    values = np.zeros(count, np.uint64)
    for i in range(5):
        inside = begins + i <= ends
        part = body[np.minimum(begins + i, ends)].astype(np.uint64) & np.uint64(127)
        values += np.where(inside, part << np.uint64(7 * i), 0).astype(np.uint64)
    words = values.astype(np.uint32)
    delta = words >> np.uint32(2) ^ (0 - (words >> np.uint32(1) & np.uint32(1))).astype(np.uint32)
    made = np.empty(count, np.uint32)
    for baseline in (0, 1):
        own = (words & np.uint32(1)) == baseline
        made[own] = np.cumsum(delta[own], dtype=np.uint32)
    return made


class _Triangles:
    """A decoder of triangles, with the edges and vertices that the next triangle may refer to."""

    def __init__(self, data: list[int]):
        self.data, self.table = data, data[-TABLE:]
        self.end = len(data) - TABLE
        self.at = self.last = self.next = 0
        self.edges: list[tuple[int, int]] = []  # the newest last
        self.vertices: list[int] = []

    def decoded(self, codes: list[int]) -> list[int]:
        """Return the indices of all triangles."""
        made: list[int] = []
        edges, vertices = self.edges, self.vertices
        for code in codes:
            if code < 0xF0:
                a, b = edges[~(code >> 4)]
                low = code & 15
                if low == 0:
                    c = self.fresh()
                elif low < 0xD:
                    c = vertices[~low]
                else:
                    if low == 0xF:
                        c = self.explicit()
                    else:
                        c = self.last = (self.last + (1 if low == 0xE else -1)) & 0xFFFFFFFF
                    vertices.append(c)
                edges += ((c, b), (a, c))
            else:
                a, b, c = self.three(code)
                edges += ((b, a), (c, b), (a, c))
            made += (a, b, c)
            if len(edges) > 1024:
                del edges[:-16]
                del vertices[:-16]
        if self.at > self.end:
            raise ValueError("it is cut short")
        return made

    def three(self, code: int) -> tuple[int, int, int]:
        """Return a triangle that shares no edge with those before."""
        known = len(self.vertices)  # those that this triangle adds cannot be meant
        if code < 0xFE:
            pair = self.table[code & 15]
            a = self.fresh()
        else:
            pair = self.byte()
            if pair == 0:
                self.next = 0
            a = self.fresh() if code == 0xFE else self.explicit(push=True)
        b = self.corner(pair >> 4, known)
        c = self.corner(pair & 15, known)
        return a, b, c

    def corner(self, number: int, known: int) -> int:
        """Return a vertex: a new one, one spelled out, or one of the `known` first."""
        if number == 0:
            return self.fresh()
        if number == 15:
            return self.explicit(push=True)
        if number > known:
            raise ValueError("it names a vertex that did not occur")
        return self.vertices[known - number]

    def fresh(self) -> int:
        """Return the next index that did not occur."""
        value = self.next
        self.next = (value + 1) & 0xFFFFFFFF
        self.vertices.append(value)
        return value

    def explicit(self, push: bool = False) -> int:
        """Return an index given by its difference from the last such one."""
        value = shift = 0
        for _ in range(5):
            byte = self.byte()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        else:
            raise ValueError("a number has more than five bytes")
        value &= 0xFFFFFFFF
        self.last = (self.last + (~(value >> 1) if value & 1 else value >> 1)) & 0xFFFFFFFF
        if push:
            self.vertices.append(self.last)
        return self.last

    def byte(self) -> int:
        """Return the next byte of the data."""
        if self.at >= self.end:
            raise ValueError("it is cut short")
        self.at += 1
        return self.data[self.at - 1]

"""Columns through Arrow's C stream interface, so that whoever reads it needs nothing of ours and we nothing of theirs.

The structs of https://arrow.apache.org/docs/format/CDataInterface.html, written with ctypes. What a consumer holds is kept alive
here until it calls `release`.
"""

from __future__ import annotations

import ctypes
from ctypes import CFUNCTYPE, POINTER, Structure, c_char_p, c_int, c_int64, c_void_p, cast, pointer
from typing import Any

import numpy as np


class Schema(Structure):
    """struct ArrowSchema."""


class Array(Structure):
    """struct ArrowArray."""


class Stream(Structure):
    """struct ArrowArrayStream."""


_ReleaseSchema = CFUNCTYPE(None, POINTER(Schema))
_ReleaseArray = CFUNCTYPE(None, POINTER(Array))
_ReleaseStream = CFUNCTYPE(None, POINTER(Stream))
_GetSchema = CFUNCTYPE(c_int, POINTER(Stream), POINTER(Schema))
_GetNext = CFUNCTYPE(c_int, POINTER(Stream), POINTER(Array))
_GetError = CFUNCTYPE(c_void_p, POINTER(Stream))

Schema._fields_ = [
    ("format", c_char_p),
    ("name", c_char_p),
    ("metadata", c_char_p),
    ("flags", c_int64),
    ("n_children", c_int64),
    ("children", POINTER(POINTER(Schema))),
    ("dictionary", POINTER(Schema)),
    ("release", _ReleaseSchema),
    ("private_data", c_void_p),
]
Array._fields_ = [
    ("length", c_int64),
    ("null_count", c_int64),
    ("offset", c_int64),
    ("n_buffers", c_int64),
    ("n_children", c_int64),
    ("buffers", POINTER(c_void_p)),
    ("children", POINTER(POINTER(Array))),
    ("dictionary", POINTER(Array)),
    ("release", _ReleaseArray),
    ("private_data", c_void_p),
]
Stream._fields_ = [
    ("get_schema", _GetSchema),
    ("get_next", _GetNext),
    ("get_last_error", _GetError),
    ("release", _ReleaseStream),
    ("private_data", c_void_p),
]

#: What a consumer still holds, by the number in `private_data`.
_held: dict[int, Any] = {}
_numbers = iter(range(1, 2**62))


def _hold(things: Any) -> int:
    number = next(_numbers)
    _held[number] = things
    return number


def _release(p: Any) -> None:
    held = p.contents
    for i in range(held.n_children):
        child = held.children[i]
        if child.contents.release:
            child.contents.release(child)
    _held.pop(held.private_data or 0, None)
    held.release = type(held.release)()


_release_schema = _ReleaseSchema(_release)
_release_array = _ReleaseArray(_release)


def _fill_schema(into: Any, layout: bytes, name: bytes, children: list[Any]) -> None:
    pointers = (POINTER(Schema) * len(children))(*(pointer(c) for c in children))
    into.format, into.name, into.metadata, into.flags = layout, name, None, 2
    into.n_children = len(children)
    into.children = cast(pointers, POINTER(POINTER(Schema)))
    into.dictionary = None
    into.release = _release_schema
    into.private_data = _hold((layout, name, children, pointers))


def _fill_array(into: Any, length: int, nulls: int, buffers: list[Any], children: list[Any]) -> None:
    addresses = (c_void_p * len(buffers))(*(None if b is None else b.ctypes.data for b in buffers))
    pointers = (POINTER(Array) * len(children))(*(pointer(c) for c in children))
    into.length, into.null_count, into.offset = length, nulls, 0
    into.n_buffers, into.n_children = len(buffers), len(children)
    into.buffers = cast(addresses, POINTER(c_void_p))
    into.children = cast(pointers, POINTER(POINTER(Array)))
    into.dictionary = None
    into.release = _release_array
    into.private_data = _hold((buffers, addresses, children, pointers))


def _column(values: Any) -> tuple[bytes, int, list[Any]]:
    """Layout, number of nulls and buffers of a column: doubles with NaN as null, integers of 32 bits, texts."""
    if isinstance(values, np.ndarray) and values.dtype == np.int32:
        return b"i", 0, [None, np.ascontiguousarray(values)]
    if isinstance(values, np.ndarray):
        there = ~np.isnan(values)
        nulls = int(len(values) - there.sum())
        bits = np.packbits(there, bitorder="little") if nulls else None
        return b"g", nulls, [bits, np.ascontiguousarray(values, dtype=np.float64)]
    texts = [str(v).encode() for v in values]
    offsets = np.zeros(len(texts) + 1, dtype=np.int32)
    np.cumsum([len(t) for t in texts], out=offsets[1:])
    return b"u", 0, [None, offsets, np.frombuffer(b"".join(texts) or b"\0", dtype=np.uint8)]


def _get_schema(p: Any, out: Any) -> int:
    children = []
    for name, (layout, _nulls, _buffers) in _held[p.contents.private_data]["parts"].items():
        child = Schema()
        _fill_schema(child, layout, name.encode(), [])
        children.append(child)
    _fill_schema(out.contents, b"+s", b"", children)
    return 0


def _get_next(p: Any, out: Any) -> int:
    state = _held[p.contents.private_data]
    parts, state["parts_left"] = state["parts_left"], None
    if parts is None:
        out.contents.release = _ReleaseArray()
        return 0
    children = []
    for _layout, nulls, buffers in parts.values():
        child = Array()
        _fill_array(child, state["length"], nulls, buffers, [])
        children.append(child)
    _fill_array(out.contents, state["length"], 0, [None], children)
    return 0


def _get_error(_: Any) -> None:
    return None


def _release_of_stream(p: Any) -> None:
    number = p.contents.private_data or 0
    p.contents.release = _ReleaseStream()
    _held.pop(number, None)


# Of the module and not of a stream: none may go while it runs.
_schema_of_stream = _GetSchema(_get_schema)
_next_of_stream = _GetNext(_get_next)
_error_of_stream = _GetError(_get_error)
_release_stream = _ReleaseStream(_release_of_stream)

#: The structs of capsules, by address: a consumer may move a stream away, and the struct stays with its capsule.
_capsules: dict[int, Any] = {}

_new = ctypes.pythonapi.PyCapsule_New
_new.restype, _new.argtypes = ctypes.py_object, [c_void_p, c_char_p, c_void_p]
_pointer = ctypes.pythonapi.PyCapsule_GetPointer
_pointer.restype, _pointer.argtypes = c_void_p, [c_void_p, c_char_p]

#: The name of the capsule, which has to outlive it.
_NAME = ctypes.create_string_buffer(b"arrow_array_stream")


def _destroy_capsule(capsule: int) -> None:
    address = _pointer(capsule, _NAME.value)
    made = _capsules.pop(address, None)
    if made is not None and made.release:
        made.release(pointer(made))


_destroy = CFUNCTYPE(None, c_void_p)(_destroy_capsule)


def stream(columns: dict[str, Any]) -> Any:
    """A PyCapsule with a stream of one batch of these columns."""
    parts = {name: _column(values) for name, values in columns.items()}
    made = Stream()
    made.get_schema, made.get_next = _schema_of_stream, _next_of_stream
    made.get_last_error, made.release = _error_of_stream, _release_stream
    length = len(next(iter(columns.values())))
    made.private_data = _hold({"parts": parts, "parts_left": parts, "length": length})
    address = ctypes.addressof(made)
    _capsules[address] = made
    return _new(address, cast(_NAME, c_char_p), cast(_destroy, c_void_p))

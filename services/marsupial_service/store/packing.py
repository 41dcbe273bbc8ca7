"""How events and inputs are stored: compressed with a dictionary of the text that nearly all of them contain.

A packed value begins with the number of its dictionary, so that more dictionaries can be added.
"""

import zlib
from collections.abc import Iterable, Iterator
from typing import Any

# rows that hold more bytes would not fit beside others on a page of 4096 (SQLite moves them to pages of their own)
PIECE = 900
_LEVEL = 6
_WINDOW = -13  # bits: 8 kB; negative for no header and no checksum
_MEMORY = 6  # of 9: a packer is copied for each value, and few are long

_DICTIONARY_1 = (
    # what is stored was packed with these very bytes: what would do better is a dictionary with another number
    b'log {"event":"mission","format":"marsupial-log","version":2,"t_ms":0,"scenario":"mission","strategy":"temporal",'
    b'"planner":"auto","seed":0,"terrains":[{"code":0,"name":"obstacle","blocks_sight":true},{"code":1,"name":"floor",'
    b'"blocks_sight":false},{"code":2,"name":"rough"}],"types":[{"role":"carrier","speed_mps":1.0,"sensor_range_'
    b'm":10.0,'
    b'"radius_m":0.3,"capacity":2,"dock_ms":10000,"undock_ms":5000,"energy":{"idle_w":20.0,"drive_w":60.0,"metre'
    b'_j":0.0,'
    b'"stop_j":0.0,"turn_j":[0.0,0.0,0.0,0.0]},"diagonal":1.4142135623730951,"routes":"shortest"}],"robots":[]}\n'
    b'log {"event":"ended","status":"complete","reason":"","remaining":[]}\nend {"status":"cancelled","reason":"",'
    b'"t_ms":0}\nstate {"state":"paused","t_ms":0}\nframe {"width":0,"height":0,"resolution_m":0.05,"origin_m":['
    b"0.0,0.0,"
    b'0.0],"shift":[0,0],"t_ms":0}\n'
    b'decision {"planner":"greedy","outcome":"satisficing","wall_s":0.0,"first_plan_s":null,"refused":0,"detail":"",'
    b'"actions":[{"name":"move","robot":"rover1_1","origin":"s_rover1_1","place":"m_","start_ms":0,"duration_ms":1},'
    b'{"name":"dock","robot":"rover2_1","carrier":"carrier2","place":"m_","start_ms":0,"duration_ms":10000}]}\n'
    b'log {"event":"plan","t_ms":0,"revision":1,"trigger":"gone: t_; new: t_","targets":[{"name":"t_","cell":[0,0],'
    b'"explorers":["carrier"],"reveal_m2":10.25,"frontier_cells":10},{"name":"t_","cell":[1,1],"explorers":["rover"],'
    b'"reveal_m2":0.5,"frontier_cells":1},"t_"],"meetings":["m_"],"makespan_ms":0,"actions":[{"name":"undock",'
    b'"start_ms":0,"duration_ms":5000,"robot":"rover2_1","place":"m_","carrier":"carrier2","origin":null}]}\n'
    b'"finished":[],"failed":[],"lost":[],"end":"done"}\nlog {"event":"stand","t_ms":0,"robot":"rover1_1","cell"'
    b":[0,0]}\n"
    b'log {"event":"end","t_ms":0,"revision":2,"action":{"name":"explore","start_ms":0,"duration_ms":1000,'
    b'"robot":"carrier2","place":"t_","carrier":null,"origin":"s_carrier2"},"end":"superseded"}\n'
    b'log {"event":"start","t_ms":0,"revision":2,"action":{"name":"explore","start_ms":0,"duration_ms":0,'
    b'"robot":"carrier1","place":"t_","carrier":null,"origin":"s_carrier1"},"cell":[0,0]}\n'
    b'log {"event":"drive","t_ms":0,"robot":"carrier1","cell":[0,0],"steps":"00000111112222233333444445555566666'
    b'77777"}\n'
    b'log {"event":"reveal","t_ms":0,"looks":[["carrier2",0,"BC8B"],["rover2_2",0,"BCBBCB"]]}\n'
    b'commands {"batch":1,"revision":2,"n":1,"t_ms":0,"until_ms":null,"commands":[{"id":1,"robot":"carrier2",'
    b'"name":"drive","revision":1,"place":"t_","route":[[1,2],[0,0]],"route_m":[[0.125,0.375],[0.625,0.875]]},{"id":2,'
    b'"robot":"carrier1","name":"stop","revision":2},{"id":3,"robot":"rover2_1","name":"dock","revision":2,'
    b'"carrier":"carrier2","place":"m_"},{"id":4,"robot":"rover1_1","name":"undock","revision":2,"carrier":"carrier1",'
    b'"place":"m_","cell":[0,0],"point_m":[0.125,0.875]}]}\n'
    b'{"control":"pause"}{"n":1,"t_ms":0,"finished":[1],"failed":[[1,""]],"lost":[["rover1_1",""]],"frame":[-1,0,100,100],'
    b'"map":[[100,100],[0,1,1]],"robot":"carrier1","revealed":[["carrier2",[1000,1,1,1003,2,1,2000,1,0,2001,10,1]],'
    b'["rover1_1",[0,1,1]]],"robots":[["rover1_1",[0,0],0,0.0,0],["carrier1",[1,2],1000,1.25,250],'
    b'["rover2_1",[100,100],null,null,null],["carrier2",[10,20],null,null,null]]}'
)
_NUMBER = b"\x01"
_PACKER = zlib.compressobj(_LEVEL, zlib.DEFLATED, _WINDOW, _MEMORY, zlib.Z_DEFAULT_STRATEGY, _DICTIONARY_1)


def pack(data: bytes) -> bytes:
    """Return `data` as it is stored."""
    # a copy has the dictionary loaded, which takes longer than to pack most values
    packer = _PACKER.copy()
    return _NUMBER + packer.compress(data) + packer.flush()


def unpack(data: bytes) -> bytes:
    """Return the data of a packed value."""
    return zlib.decompressobj(_WINDOW, _DICTIONARY_1).decompress(memoryview(data)[1:])


def split(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the parts in which `data` is stored, with their numbers from 0."""
    for part, start in enumerate(range(0, len(data), PIECE)):
        yield part, data[start : start + PIECE]


def joined(rows: Iterable[Any]) -> Iterator[tuple[Any, bytes]]:
    """Yield the first row of each value that is stored in parts, and the value; `rows` have `part` and `data`."""
    first: Any = None
    parts: list[bytes] = []
    for row in rows:
        if row["part"] == 0:
            if parts:
                yield first, unpack(b"".join(parts))
            first, parts = row, []
        parts.append(row["data"])
    if parts:
        yield first, unpack(b"".join(parts))

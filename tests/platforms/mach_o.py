"""Reads 64-bit Mach-O files, the programs and libraries of macOS: only as much as tests ask."""
import struct
from dataclasses import dataclass, field

MAGIC = 0xFEEDFACF
CPUS = {0x01000007: "x86_64", 0x0100000C: "aarch64"}
KINDS = {1: "object", 2: "program", 6: "library"}
# Load commands.
SEGMENT, SYMBOLS, LOADED, LOADED_WEAKLY, REEXPORTED, NAME, SIGNATURE, EXPORTS, EXPORTS_TRIE, BUILD_VERSION = (
    0x19, 0x2, 0xC, 0x80000018, 0x8000001F, 0xD, 0x1D, 0x80000022, 0x80000033, 0x32)
EXTERNAL, DEFINED, WEAK = 0x01, 0x0E, 0x80


@dataclass
class MachO:
    """cpu and kind: of CPUS and KINDS; loads: the libraries; name: that by which others load a library; exports: what dyld finds; defined: the
    addresses of all symbols that are in the file, and weak: those of them that the linker may take from any file; text: the machine code, and text_address;
    oldest: version of macOS; signed: it has a signature."""
    cpu: str
    kind: str
    loads: set = field(default_factory=set)
    name: str = None
    exports: set = field(default_factory=set)
    defined: dict = field(default_factory=dict)
    weak: set = field(default_factory=set)
    text: bytes = b""
    text_address: int = 0
    oldest: tuple = None
    signed: bool = False


def is_mach_o(path):
    with open(path, "rb") as file:
        return file.read(4) == struct.pack("<I", MAGIC)


def read(path):
    data = path.read_bytes()
    magic, cpu, _, kind, count = struct.unpack_from("<5I", data)
    if magic != MAGIC:
        raise ValueError(f"{path} is no 64-bit Mach-O file")
    file = MachO(CPUS[cpu], KINDS[kind])
    at = 32
    for _ in range(count):
        command, size = struct.unpack_from("<2I", data, at)
        _take(file, data, command, at, size)
        at += size
    return file


def _take(file, data, command, at, size):
    if command in (LOADED, LOADED_WEAKLY, REEXPORTED, NAME):
        (start,) = struct.unpack_from("<I", data, at + 8)
        name = data[at + start:at + size].split(b"\0")[0].decode()
        if command == NAME:
            file.name = name
        else:
            file.loads.add(name)
    elif command == BUILD_VERSION:
        (version,) = struct.unpack_from("<I", data, at + 12)
        file.oldest = version >> 16, version >> 8 & 0xFF
    elif command == SIGNATURE:
        file.signed = True
    elif command == SYMBOLS:
        _take_symbols(file, data, *struct.unpack_from("<4I", data, at + 8))
    elif command == EXPORTS:
        _take_exports(file, data, *struct.unpack_from("<2I", data, at + 40))
    elif command == EXPORTS_TRIE:
        _take_exports(file, data, *struct.unpack_from("<2I", data, at + 8))
    elif command == SEGMENT:
        (sections,) = struct.unpack_from("<I", data, at + 64)
        for section in range(at + 72, at + 72 + 80 * sections, 80):
            if data[section:section + 16].rstrip(b"\0") == b"__text":
                file.text_address, length, start = struct.unpack_from("<QQI", data, section + 32)
                file.text = data[start:start + length]


def _take_symbols(file, data, start, count, names, _):
    for at in range(start, start + 16 * count, 16):
        name, kind, _, description, address = struct.unpack_from("<IBBHQ", data, at)
        if kind & 0xE0 == 0 and kind & DEFINED == DEFINED:  # not for debuggers, and in a section
            end = data.index(b"\0", names + name)
            text = data[names + name:end].decode()
            file.defined[text] = address
            if kind & EXTERNAL and description & WEAK:
                file.weak.add(text)


def _take_exports(file, data, start, size):
    """A tree of letters. A node: the length of what it says of the name that ends there, and its branches, each letters and the place of a node."""
    def number(at):
        value = shift = 0
        while True:
            value |= (data[at] & 0x7F) << shift
            shift += 7
            at += 1
            if data[at - 1] < 0x80:
                return value, at

    nodes = [(start, "")] if size else []
    while nodes:
        at, prefix = nodes.pop()
        told, at = number(at)
        if told:
            file.exports.add(prefix)
        at += told
        branches = data[at]
        at += 1
        for _ in range(branches):
            end = data.index(b"\0", at)
            letters = data[at:end].decode()
            place, at = number(end + 1)
            nodes.append((start + place, prefix + letters))

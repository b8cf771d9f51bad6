"""Reads a header of the C interface: its constants, structs and functions, and how structs lie in memory."""
import re
from dataclasses import dataclass

# {type of a field in C: its bytes}; pointers have 8.
BYTES = {"uint8_t": 1, "uint32_t": 4, "int32_t": 4, "tandem_status": 4, "float": 4, "uint64_t": 8, "int": 4, "double": 8, "size_t": 8}

_COMMENT = re.compile(r"//.*")
_DOC = r"((?:^///[^\n]*\n)*)"
_STRUCT = re.compile(_DOC + r"^typedef struct (\w+) \{\n(.*?)^\} \2;", re.MULTILINE | re.DOTALL)
_HANDLE = re.compile(r"^typedef struct (\w+)\*? (\w+);", re.MULTILINE)
_FUNCTION = re.compile(_DOC + r"^TANDEM_API ([\w* ]+?)\s*\b(tandem_\w+)\(([^)]*)\);", re.MULTILINE)
_ENUM = re.compile(r"^enum \{(.*?)\};", re.MULTILINE | re.DOTALL)
_ENUMERATOR = re.compile(r"(TANDEM_\w+) = (\w+),?(?:\s*///< (.*(?:\n\s*///< .*)*))?")
_DEFINE = re.compile(r"^#define (TANDEM_\w+) (\w+)$", re.MULTILINE)
_CALLBACK = re.compile(r"([\w* ]+?)\(\*(\w+)\)\(([^)]*)\)")


@dataclass
class Variable:
    """A field or a parameter. type: in C, with * behind where it is a pointer, or a Function where it points to one."""
    type: object
    name: str
    counts: tuple = ()  # of an array


@dataclass
class Function:
    name: str
    result: str
    parameters: list
    doc: str = ""


@dataclass
class Struct:
    name: str
    fields: list
    doc: str

    @property
    def grows(self):
        """Whether it begins with its size. The others are rows."""
        return self.fields[0].name == "struct_size"


@dataclass
class Header:
    constants: list  # of (name, number, comment)
    handles: list
    structs: list
    functions: list


def _words(comment):
    return re.sub(r"\s*///<?\s*", " ", comment or "").strip()


def _pointer_type(text):
    """"const char *" and "const char*" are the same."""
    return re.sub(r"\s*\*\s*", "*", text).strip()


def _variables(declaration):
    """Of "const uint32_t *few, *many" or "double rotation[3][3]"."""
    first, *others = declaration.split(",")
    match = re.fullmatch(r"\s*((?:const )?\w+)\s*(.*)", first, re.DOTALL)
    for declarator in [match[2], *others]:
        stars, name, counts = re.fullmatch(r"\s*([\w* ]*?\*)?\s*(\w+)((?:\[\d+\])*)\s*", declarator, re.DOTALL).groups()
        yield Variable(_pointer_type(match[1] + (stars or "")), name, tuple(int(count) for count in re.findall(r"\d+", counts)))


def _parameters(text):
    return [] if text.strip() == "void" else [variable for part in text.split(",") for variable in _variables(" ".join(part.split()))]


def _fields(body):
    for declaration in filter(str.strip, _COMMENT.sub("", body).split(";")):
        callback = _CALLBACK.fullmatch(" ".join(declaration.split()))
        if callback:
            yield Variable(Function(callback[2], _pointer_type(callback[1]), _parameters(callback[3])), callback[2])
        else:
            yield from _variables(declaration)


def _enumerators(text):
    return [(name, int(number, 0), _words(comment)) for body in _ENUM.findall(text) for name, number, comment in _ENUMERATOR.findall(body)]


def read(path):
    """A header in the style of tandem.h, as clang-format leaves it."""
    text = path.read_text(encoding="utf-8")
    constants = _enumerators(text) + [(name, int(number.rstrip("u"), 0), "") for name, number in _DEFINE.findall(text)]
    structs = [Struct(name, list(_fields(body)), _words(doc)) for doc, name, body in _STRUCT.findall(text)]
    functions = [Function(name, _pointer_type(result), _parameters(parameters), _words(doc)) for doc, result, name, parameters in _FUNCTION.findall(text)]
    return Header(constants, [name for _, name in _HANDLE.findall(text)], structs, functions)


def layouts(structs, pointer=8):
    """{name of a struct: (bytes, alignment, {field: offset})} by the rule of C: each field at a multiple of its alignment. pointer: the bytes of one."""
    known = {}
    for struct in structs:
        end, widest, offsets = 0, 1, {}
        for field in struct.fields:
            if isinstance(field.type, Function) or field.type.endswith("*") or field.type == "size_t":
                size = align = pointer
            elif field.type in known:
                size, align, _ = known[field.type]
            else:
                size = align = BYTES[field.type]
            for count in field.counts:
                size *= count
            offsets[field.name] = end = -(-end // align) * align
            end, widest = end + size, max(widest, align)
        known[struct.name] = (-(-end // widest) * widest, widest, offsets)
    return known

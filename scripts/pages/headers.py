"""The reference of the C++ and C headers: a page for each public header, from the XML that Doxygen writes of it (docs/site/Doxyfile)."""
import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from html import escape
from pathlib import Path
from posixpath import relpath

from . import titles

C_HEADERS = ("tandem.h", "tandem_cuda.h")
# {folder of the site: (title, which headers)}; the first that fits has a header.
GROUPS = {
    "questions": ("Scenes and questions", r"kernels/include/"),
    "gpu": ("On a GPU", r"/cuda/include/"),
    "dynamics": ("Worlds that move", r"dynamics/"),
    "runtime": ("Loading files", r"runtime/"),
    "formats": ("Files and blocks", r"formats/"),
    "build": ("Building trees", r"tools/bvhbuild/"),
}
WIDTH = 90


def place_of(header):
    """Where the page of a header lies in the site."""
    name = Path(header).stem
    if Path(header).name in C_HEADERS:
        return f"reference/c/{name}.md"
    group = next(group for group, (_, fits) in GROUPS.items() if re.search(fits, header))
    return f"reference/cpp/{group}/{name}.md"


def spaced(code):
    """C++ as the project writes it: `const Pose& pose`, `std::span<const Pose>`."""
    code = re.sub(r"\s+([&*]+)\s*(?=[\w,)>]|$)", r"\1 ", re.sub(r"<\s+", "<", re.sub(r"\s+>", ">", code)))
    return re.sub(r"\s+([,)>])", r"\1", code).strip()


def text_of(element):
    return "".join(element.itertext()) if element is not None else ""


def marked(text):
    """Text that Markdown shows as it is."""
    return re.sub(r"([\\`*_\[\]|])", r"\\\1", escape(text, quote=False))


def is_operator(member):
    return re.match(r"operator\W|operator (?:new|delete)", text_of(member.find("name"))) is not None


class Reference:
    """Reads Doxygen's XML once. pages(): {place in the site: Markdown}."""

    def __init__(self, root, folder):
        self.root = root
        self.compounds = {}
        self.anchors = {}  # {id of Doxygen's: (place, anchor)}
        for path in folder.glob("*.xml"):
            if path.name.startswith(("class", "struct", "union", "namespace")) or path.name.endswith("_8h.xml"):
                compound = ElementTree.parse(path).getroot().find("compounddef")
                self.compounds[compound.get("id")] = compound
        self.files = {compound.find("location").get("file"): compound for compound in self.compounds.values() if compound.get("kind") == "file"}
        self.places = {header: place_of(header) for header in self.files}
        self.entities = {header: list(self.entities_of(compound)) for header, compound in self.files.items()}
        for header, entities in self.entities.items():
            for entity in entities:
                self.name(entity, self.places[header])

    # This tells what there is, and where.

    def entities_of(self, file):
        """Types and members of a header in the order of its lines; overloads of a function are one entity, a list."""
        found = []
        for inner in file.findall("innerclass"):
            compound = self.compounds.get(inner.get("refid"))
            if compound is not None and "@" not in text_of(compound.find("compoundname")) and "::detail::" not in text_of(inner) and inner.get("prot", "public") == "public":
                found.append(compound)
        for member in file.iterfind("sectiondef/memberdef"):
            if member.get("kind") == "typedef" and text_of(member.find("type")) == f"struct {text_of(member.find('name'))}" and self.is_struct(text_of(member.find("name"))):
                continue
            if "::detail::" in text_of(member.find("qualifiedname")) or member.get("kind") == "define" and text_of(member.find("name")).endswith(("_H", "_API", "_HD")):
                continue
            found.append(member)
        found.sort(key=lambda entity: int(entity.find("location").get("line")))
        return self.grouped(found)

    def is_struct(self, name):
        """Whether a struct of C is described, so that `typedef struct name name` says nothing more."""
        return any(text_of(compound.find("compoundname")) == name for compound in self.compounds.values())

    @staticmethod
    def grouped(members):
        """Functions of one name that follow each other become a list."""
        groups = []
        for member in members:
            if groups and member.get("kind") == "function" and groups[-1][0].get("kind") == "function" and text_of(groups[-1][0].find("name")) == text_of(member.find("name")):
                groups[-1].append(member)
            else:
                groups.append([member])
        return groups

    def members_of(self, compound):
        members = [member for member in compound.iterfind("sectiondef/memberdef") if member.get("prot") == "public"]
        members = [member for member in members if member.get("kind") != "friend" and not text_of(member.find("definition")).startswith("friend")]
        return self.grouped(sorted(members, key=lambda member: int(member.find("location").get("line"))))

    @staticmethod
    def full_name(entity):
        name = text_of(entity.find("compoundname")) or text_of(entity.find("qualifiedname")) or text_of(entity.find("name"))
        return name.removeprefix("tandem::").replace("tandem::build::", "build::")

    def anchor_of(self, entity):
        name = self.full_name(entity)
        if "@" in name:
            name = text_of(entity.find("enumvalue/name"))
        return re.sub(r"[^\w.~-]", "", name.replace("::", "."))

    def name(self, group, place):
        anchor = self.anchor_of(group[0])
        for entity in group if not is_operator(group[0]) else ():
            self.anchors[entity.get("id")] = (place, anchor)
            for value in entity.iterfind("enumvalue"):
                self.anchors[value.get("id")] = (place, anchor)
            if entity.tag == "compounddef":
                for members in self.members_of(entity):
                    self.name(members, place)
                    if members[0].get("kind") == "variable":
                        self.anchors[members[0].get("id")] = (place, anchor)

    # Markdown of descriptions.

    def linked(self, element, place, code=False):
        """A <ref> as a link, if it leads to a page."""
        there = self.anchors.get(element.get("refid"))
        text = marked(text_of(element))
        text = f"`{text_of(element)}`" if not code and re.search(r"[_:(]|[a-z][A-Z]", text_of(element)) else text
        return text if there is None else f"[{text}]({relpath(there[0], str(Path(place).parent))}#{there[1]})"

    def inline(self, element, place):
        parts = [marked(element.text or "")]
        for child in element:
            if child.tag == "ref":
                parts.append(self.linked(child, place))
            elif child.tag == "computeroutput":
                parts.append(f"`{text_of(child)}`")
            elif child.tag in ("emphasis", "bold"):
                parts.append({"emphasis": "*", "bold": "**"}[child.tag].join(["", self.inline(child, place), ""]))
            elif child.tag in ("itemizedlist", "orderedlist"):
                sign = "- " if child.tag == "itemizedlist" else "1. "
                parts.append("\n\n" + "\n".join(sign + self.block(item, place).replace("\n\n", " ") for item in child) + "\n\n")
            elif child.tag in ("programlisting", "verbatim"):
                code = "\n".join(text_of(line) for line in child) if child.tag == "programlisting" else text_of(child)
                parts.append(f"\n\n```cpp\n{code.strip()}\n```\n\n")
            elif child.tag == "simplesect":
                parts.append("\n\n" + self.block(child, place) + "\n\n")
            else:
                parts.append(self.inline(child, place))
            parts.append(marked(child.tail or ""))
        text = "".join(parts)
        return self.with_pages(text, place)

    @staticmethod
    def with_pages(text, place):
        return titles.linked(text, lambda name: relpath(f"{name}.md", str(Path(place).parent)))

    def block(self, element, place):
        return "\n\n".join(filter(None, (self.inline(para, place).strip() for para in element.findall("para"))))

    def description(self, entity, place):
        parts = [self.block(entity.find(tag), place) for tag in ("briefdescription", "detaileddescription") if entity.find(tag) is not None]
        return "\n\n".join(filter(None, parts))

    # Markdown of entities.

    def code(self, element, place):
        """A type, with links, within <code>."""
        parts = [marked(element.text or "")]
        for child in element:
            parts += [self.linked(child, place, code=True), marked(child.tail or "")]
        return "".join(parts)

    @staticmethod
    def template(entity):
        parameters = entity.find("templateparamlist")
        if parameters is None:
            return ""
        return "template <" + ", ".join(f"{text_of(param.find('type'))} {text_of(param.find('declname'))}".strip() for param in parameters.findall("param")) + ">\n"

    def signature(self, function):
        result = spaced(text_of(function.find("type")))
        start = f"{self.template(function)}{result + ' ' if result else ''}{text_of(function.find('name'))}("
        if function.get("static") == "yes":
            start = "static " + start
        parameters = []
        for param in function.findall("param"):
            told = spaced(text_of(param.find("type")) + " " + text_of(param.find("declname")) + text_of(param.find("array")))
            default = text_of(param.find("defval"))
            parameters.append(told + (f" = {spaced(default)}" if default else ""))
        end = ")" + (" const" if function.get("const") == "yes" else "") + (" noexcept" if "noexcept" in text_of(function.find("argsstring")) else "")
        line = start + ", ".join(parameters) + end
        if len(line.rsplit("\n", 1)[-1]) > WIDTH:
            line = start + "\n    " + ",\n    ".join(parameters) + end
        return line + ";"

    def functions(self, group, place, level):
        name = self.full_name(group[0])
        lines = [f"{'#' * level} `{name}()` {{ #{self.anchor_of(group[0])} }}", "", "```cpp", *(self.signature(function) for function in group), "```", ""]
        return lines + [part for function in group for part in (self.description(function, place), "") if part or function is group[-1]]

    def values(self, enum, place):
        for value in enum.findall("enumvalue"):
            told = text_of(value.find("initializer"))
            meaning = self.description(value, place).replace("\n\n", " ")
            yield f"- `{text_of(value.find('name'))}{' ' + told if told else ''}`" + (f": {meaning}" if meaning else "")

    def field(self, member, place, others):
        """The fields of one line share the comment behind the last of them."""
        initial = text_of(member.find("initializer"))
        array = spaced(text_of(member.find("argsstring")))
        declared = f"<code>{spaced(self.code(member.find('type'), place))} <strong>{marked(text_of(member.find('name')))}</strong>{marked(array)}{' ' + marked(spaced(initial)) if 0 < len(initial) < 40 else ''}</code>"
        line = member.find("location").get("line")
        same_line = [member, *(other for other in others if other.find("location").get("line") == line)]
        meaning = next(filter(None, (self.description(other, place) for other in same_line)), "").replace("\n\n", " ")
        return f"- {declared}" + (f": {meaning}" if meaning else "")

    def inherited(self, compound, place):
        """Lists the functions that a question has from its base classes."""
        name = text_of(compound.find("compoundname")).split("::")[-1]
        for base in compound.findall("basecompoundref"):
            of = self.compounds.get(base.get("refid"))
            if of is None:
                continue
            functions = [group[0] for group in self.members_of(of) if group[0].get("kind") == "function" and "~" not in text_of(group[0].find("name"))]
            for function in functions:
                there = self.anchors.get(function.get("id"))
                if there and text_of(function.find("name")) != text_of(of.find("compoundname")).split("::")[-1]:
                    yield f"[`{name}::{text_of(function.find('name'))}()`]({relpath(there[0], str(Path(place).parent))}#{there[1]})"
            yield from self.inherited_by(name, of, place)

    def inherited_by(self, name, compound, place):
        of = text_of(compound.find("compoundname")).split("::")[-1]
        return [line.replace(f"`{of}::", f"`{name}::") for line in self.inherited(compound, place)]

    def compound(self, compound, place, level):
        name = self.full_name(compound)
        bases = [spaced(text_of(base)).replace("tandem::", "") for base in compound.findall("basecompoundref")]
        lines = [f"{'#' * level} `{name}` {{ #{self.anchor_of(compound)} }}", ""]
        if bases or compound.find("templateparamlist") is not None:
            lines += ["```cpp", f"{self.template(compound)}{compound.get('kind')} {name.split('::')[-1]}" + (f" : {', '.join(bases)}" if bases else "") + ";", "```", ""]
        lines += [self.description(compound, place), ""]
        inherited = list(dict.fromkeys(self.inherited(compound, place)))
        if inherited:
            lines += ["Inherited: " + ", ".join(inherited) + ".", ""]
        members = self.members_of(compound)
        fields = [group[0] for group in members if group[0].get("kind") == "variable"]
        lines += [self.field(field, place, fields[k + 1:]) for k, field in enumerate(fields)] + [""]
        for group in members:
            if group[0].get("kind") != "variable":
                lines += self.entity(group, place, level + 1)
        return lines

    def entity(self, group, place, level):
        entity = group[0]
        if entity.tag == "compounddef":
            return self.compound(entity, place, level)
        kind, name = entity.get("kind"), self.full_name(entity)
        if kind == "function":
            return self.functions(group, place, level) if not is_operator(entity) else []
        heading = f"{'#' * level} `{name}` {{ #{self.anchor_of(entity)} }}"
        if kind == "enum":
            if "@" in name:
                heading = f"{'#' * level} `{text_of(entity.find('enumvalue/name'))}` and others {{ #{self.anchor_of(entity)} }}"
            return [heading, "", self.description(entity, place), "", *self.values(entity, place), ""]
        initial = spaced(text_of(entity.find("initializer")))
        if kind == "define":
            code = f"#define {name} {initial}"
        elif kind == "typedef":
            target = spaced(text_of(entity.find("type")))
            code = spaced(text_of(entity.find("definition"))).replace("tandem::", "") + ";" if not target.startswith("struct ") else f"typedef {target} {name};"
        else:
            code = spaced(f"{text_of(entity.find('type'))} {name.split('::')[-1]}{text_of(entity.find('argsstring'))} {initial if len(initial) < 60 else ''}") + ";"
        return [heading, "", "```cpp", code, "```", "", self.description(entity, place), ""]

    # Pages.

    def parts_of(self, header):
        """(line, title) of the headings "/// ---- Title" of a C header, and what its first lines say."""
        lines = (self.root / header).read_text(encoding="utf-8").split("\n")
        first = next(k for k, line in enumerate(lines) if not line.startswith("///"))
        about = self.with_pages("\n".join(line[4:] for line in lines[:first]), self.places[header])
        parts = [(k + 1, line.removeprefix("/// ---- ").rstrip(".")) for k, line in enumerate(lines) if line.startswith("/// ---- ")]
        return about.replace("\n- ", "\n\n- ", 1), parts

    def page(self, header):
        place = self.places[header]
        included = header.partition("include/")[2]
        lines = [f"# {Path(header).name}", "", "```cpp", f"#include <{included}>", "```", ""]
        is_c = Path(header).name in C_HEADERS
        about, parts = self.parts_of(header) if is_c else ("", [])
        lines += [about, ""]
        for group in self.entities[header]:
            at = int(group[0].find("location").get("line"))
            while parts and parts[0][0] < at:
                title = parts.pop(0)[1].partition(":")
                lines += [f"## {title[0].strip()}", "", title[2].strip().capitalize(), ""]
            lines += self.entity(group, place, 3 if is_c else 2)
        return "\n".join(lines) + "\n"

    def names_of(self, header, at):
        """Links to the types and functions of a header."""
        for group in self.entities[header]:
            kind, name = group[0].get("kind"), self.full_name(group[0])
            if "@" in name or kind in ("variable", "define", "typedef") or "operator" in name or name.count("::") > name.startswith("build::"):
                continue
            place, anchor = self.anchors[group[0].get("id")]
            yield f"[`{name}{'()' if kind == 'function' else ''}`]({relpath(place, at)}#{anchor})"

    def pages(self):
        made = {self.places[header]: self.page(header) for header in sorted(self.files)}
        made["reference/c/SUMMARY.md"] = "- [tandem.h](tandem.md)\n- [tandem_cuda.h](tandem_cuda.md)\n"
        contents, overview = ["- [All names](index.md)"], ["# C++ reference", "", "Each header has a page. All names are in the namespace `tandem`, and those of the builder in `tandem::build`.", ""]
        for group, (title, _) in GROUPS.items():
            headers = sorted((header for header, place in self.places.items() if place.startswith(f"reference/cpp/{group}/")), key=lambda header: Path(header).stem)
            contents += [f"- {title}"] + [f"    - [{Path(header).name}]({group}/{Path(header).stem}.md)" for header in headers]
            overview += [f"## {title}", ""]
            for header in headers:
                overview.append(f"- [{Path(header).name}]({group}/{Path(header).stem}.md): " + (", ".join(self.names_of(header, "reference/cpp")) or "constants"))
            overview.append("")
        made["reference/cpp/SUMMARY.md"] = "\n".join(contents) + "\n"
        made["reference/cpp/index.md"] = "\n".join(overview) + "\n"
        return made


def read(root, work):
    """Runs Doxygen in `root`, which writes to the folder `work`, and reads what it wrote."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    settings = (root / "docs/site/Doxyfile").read_text(encoding="utf-8") + f'\nOUTPUT_DIRECTORY = "{work}"\n'
    subprocess.run(["doxygen", "-"], input=settings, text=True, cwd=root, check=True)
    return Reference(root, work / "xml")

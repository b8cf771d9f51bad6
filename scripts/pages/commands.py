"""Makes the page of all commands and options from what the programs print for --help."""
import re

PROGRAMS = ("bvhbuild", "bvhinfo", "bvhbench")
START = """# Command line

This page lists all commands and their options, as the programs print them for `--help`. The brackets behind an option hold its value if it is not given. A build with CUDA has more options, which [the page about GPUs](gpu.md) explains. The pages about [scenes](scenes.md) and [simulations](simulation.md) show the commands at work, and [another page](json.md) lists the keys of their JSON.
"""
TITLES = {"Positionals:": "Arguments", "Options:": None, "Subcommands:": "Commands"}
NAME_WIDTH = 28


def escaped(text):
    return re.sub(r"([<>*_|\[\]])", r"\\\1", text)


def rows(lines):
    """(name, meaning) of the rows of a list, and of a group of options within it. Meanings begin in one column, or in the next line behind a long name."""
    found = []
    for line in lines:
        if re.match(r"^ {10,}\S", line):
            found[-1][1] = f"{found[-1][1]} {line.strip()}".strip()
        elif re.match(r"^ {2,4}\S", line) and line.strip() not in TITLES:
            column = len(line) - len(line.lstrip()) + NAME_WIDTH
            split = column if line[column - 1:column] == " " and not re.match(r"\[.*\]$", line[column:]) else len(line)
            found.append([line[:split].strip(), line[split:].strip()])
    return found


def option(words, name, meaning):
    """A heading for an option, so that the search lists it and others can link to it. name: such as "-o,--output FILE", or a remark in brackets about those that follow."""
    if name.startswith("["):
        return f"{sentence(name.strip('[]'))}\n"
    anchor = "-".join([*words, re.search(r"--([\w-]+)|-(\w)", name)[0].lstrip("-")])
    name, _, excluded = name.partition(" Excludes: ")
    if excluded:
        meaning += f" (not with {excluded.replace(' ', ', ')})"
    return f"#### `{name}` {{#{anchor} .option}}\n\n{escaped(meaning)}\n"


def section(words, text):
    """Markdown of one --help: what it says, its usage, its lists, its notes. words: the command, such as ("bvhbench", "scene", "pile")."""
    lines = [f"{'#' * min(len(words) + 1, 3)} {' '.join(words)}\n"]
    for part in text.strip().split("\n\n"):
        head, *rest = part.split("\n")
        if head in TITLES:
            shown = [(name, meaning) for name, meaning in rows(rest) if not name.startswith("-h,") or len(words) == 1]
            if head == "Options:":
                lines += [option(words, name, meaning) for name, meaning in shown]
                continue
            lines += [TITLES[head] + ":\n"] * bool(shown)
            for name, meaning in shown:
                told = f"[`{name}`](#{'-'.join([*words, name])})" if head == "Subcommands:" else f"`{name}`"
                lines.append(f"- {told}: {escaped(meaning)}" if meaning else f"- {told}")
            lines += [""] * bool(shown)
        elif rest and rest[0].startswith("Usage:"):
            lines += [sentence(head) + "\n", f"```\n{rest[0].removeprefix('Usage: ')}\n```\n"]
        elif not part.startswith("Exit codes:") or len(words) == 1:
            lines += [escaped(" ".join(note.split("\n"))) + "\n" for note in re.split(r"\n(?=Exit codes:)", part)]
    return "\n".join(lines)


def sentence(text):
    return escaped(text[0].upper() + text[1:] + ("" if text.endswith(".") else "."))


def sections(help_of, *words):
    """The section of a command, and those of its commands."""
    text = help_of(*words)
    yield section(words, text)
    commands = re.search(r"^Subcommands:\n((?:  .*\n)*)", text, re.MULTILINE)
    for name in re.findall(r"^  (\w+)", commands[1] if commands else "", re.MULTILINE):
        yield from sections(help_of, *words, name)


def page(help_of):
    """Markdown of the page. help_of: returns what a command, as its words, prints for --help."""
    parts = [START, *(part for program in PROGRAMS for part in sections(help_of, program))]
    return "\n".join(parts).rstrip("\n") + "\n"

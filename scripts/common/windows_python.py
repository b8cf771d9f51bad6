"""The headers and the import library that an extension for Python on Windows is compiled with elsewhere. It has the stable ABI, so one serves all versions.

A Python for Windows has these files, but no package index has them. The headers are the same on all systems but for pyconfig.h, and abi3info lists the functions.
"""
import shutil
from pathlib import Path

from common import tools

# The stable ABI's headers ask no more than this about x86-64 Windows and MinGW's GCC.
PYCONFIG = """#pragma once
#define MS_WINDOWS
#define MS_WIN32
#define MS_WIN64
#define NT_THREADS
#define HAVE_DECLSPEC_DLL
#define Py_ENABLE_SHARED 1
#define WITH_DOC_STRINGS 1
#define HAVE_SSIZE_T 1
#define HAVE_SYS_STAT_H 1
#define HAVE_WCHAR_H 1
#define SIZEOF_SHORT 2
#define SIZEOF_INT 4
#define SIZEOF_LONG 4
#define SIZEOF_LONG_LONG 8
#define SIZEOF_FLOAT 4
#define SIZEOF_DOUBLE 8
#define SIZEOF_WCHAR_T 2
#define SIZEOF_SIZE_T 8
#define SIZEOF_VOID_P 8
#define SIZEOF_TIME_T 8
#define SIZEOF_OFF_T 4
#define SIZEOF_FPOS_T 8
#define SIZEOF_PID_T 8
#define ALIGNOF_MAX_ALIGN_T 16
#ifndef Py_LIMITED_API
#error "only the stable ABI is described here"
#endif
"""
# Prints a .def file of the functions and data that Python 3.12 has on Windows.
SYMBOLS = """
from abi3info import DATAS, FUNCTIONS
there = lambda of: of.added.minor <= 12 and (of.ifdef is None or of.ifdef.windows is True)
print("LIBRARY python3.dll", "EXPORTS", sep="\\n")
print(*sorted([f.symbol.name for f in FUNCTIONS.values() if there(f)] + [d.symbol.name + " DATA" for d in DATAS.values() if there(d)]), sep="\\n")
"""


def provide(python, folder):
    """Writes both into the folder. python is 3.12 or later and has abi3info. Returns CMake's options that name the files."""
    shutil.rmtree(folder, ignore_errors=True)
    include = Path(tools.run(python, "-c", "import sysconfig; print(sysconfig.get_path('include'))").strip())
    shutil.copytree(include, folder / "include")
    (folder / "include/pyconfig.h").write_text(PYCONFIG, encoding="ascii")
    (folder / "python3.def").write_text(tools.run(python, "-c", SYMBOLS), encoding="ascii")
    library, named = folder / "libpython3.dll.a", folder / f"lib{include.name.replace('.', '')}.dll.a"
    tools.run("x86_64-w64-mingw32-dlltool", "--deterministic-libraries", "-d", folder / "python3.def", "-l", library)
    shutil.copyfile(library, named)  # CMake looks for a version in the name, even where it then links the other library.
    return [f"-DPython_INCLUDE_DIR={folder}/include", f"-DPython_LIBRARY={named}", f"-DPython_SABI_LIBRARY={library}"]

#!/usr/bin/python3
"""Fails on an include that the architecture does not allow, on a circle of includes, and on a folder of too many files.

    tests/layering_test.py SOURCE_DIR

docs/architecture.md draws the same arrows. A module is a header with the sources of its name, or a source
alone. Row kernels (NAME_rows) may include the types of the module NAME that calls them.
"""
import collections
import pathlib
import re
import sys

# Each library with those it may include besides itself.
ALLOWED = {
    "isp/base": "",
    "isp/model": "isp/base",
    "isp/codec": "isp/base",
    "capture": "isp/model isp/codec isp/base",
    "calib": "isp/model isp/base",
    "denoise": "isp/model isp/base",
    "isp/merge": "isp/model isp/base",
    "isp/raw": "isp/model isp/base",
    "isp/render": "isp/model isp/base",
    "isp/output": "isp/model isp/codec isp/base",
    "isp/pipeline": "isp/merge isp/raw denoise isp/render isp/model isp/base",
    "isp/metrics": "isp/render isp/model isp/base",
    "isp/cost": "isp/metrics isp/pipeline isp/merge isp/render isp/model isp/base",
    "isp/reproduce": "isp/metrics capture isp/output isp/raw isp/render isp/model isp/codec isp/base",
    "isp/bench": "isp/cost isp/reproduce isp/metrics isp/pipeline capture calib isp/output isp/merge isp/raw denoise "
                 "isp/render isp/model isp/codec isp/base",
    "isp/adapter": "isp/pipeline calib isp/raw isp/render isp/model isp/base",
    "isp/gstreamer": "isp/adapter",
    "isp/cli": "isp/bench isp/cost isp/reproduce isp/metrics isp/adapter isp/pipeline capture calib isp/output isp/merge "
               "isp/raw denoise isp/render isp/model isp/codec isp/base",
    "isp/python": "isp/cli isp/bench isp/cost isp/reproduce isp/metrics isp/adapter isp/pipeline capture calib isp/output isp/merge "
                  "isp/raw denoise isp/render isp/model isp/codec isp/base",
}
MOST_FILES_IN_A_FOLDER = 35
# Third parties stay in .cpp files; headers may use the standard library (no dot, no slash), those of C and POSIX, and these.
ALLOWED_IN_HEADERS = re.compile(r"tl/expected\.hpp|sys/.*|hwy/.*|std(def|int)\.h|unistd\.h")
# What one folder alone may include in its headers, which are for itself alone.
ALLOWED_IN_HEADERS_OF = {"isp/gstreamer": re.compile(r"gst/.*"), "isp/python": re.compile(r"pybind11/.*")}


def library_of(path):
    return next((name for name in ALLOWED if path.startswith(name + "/")), None)


def module_of(path):
    return re.sub(r"(-inl)?\.(h|cpp)$", "", path)


def circles(edges):
    """@return groups of modules each of which includes all others of its group, if only by way of them (Tarjan 1972)"""
    number, low, path, found = {}, {}, [], []

    def visit(module):
        number[module] = low[module] = len(number)
        path.append(module)
        for other in edges[module]:
            if other not in number:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in path:
                low[module] = min(low[module], number[other])
        if low[module] == number[module]:
            group = path[path.index(module):]
            del path[path.index(module):]
            if len(group) > 1:
                found.append(sorted(group))

    for module in sorted(edges):
        if module not in number:
            visit(module)
    return found


def main():
    root = pathlib.Path(sys.argv[1])
    files = [path.relative_to(root).as_posix() for library in ALLOWED for path in sorted((root / library).rglob("*"))
             if path.suffix in (".h", ".cpp")]
    faults, edges = [], collections.defaultdict(set)
    for file in files:
        library = library_of(file)
        text = (root / file).read_text()
        for included in re.findall(r'^[ \t]*#[ \t]*include "([^"]+)"', text, re.MULTILINE):
            target = library_of(included)
            if target is None or target != library and target not in ALLOWED[library].split():
                faults.append(f"{file}: {library} may not include {included}")
            elif module_of(file) not in (module_of(included), module_of(included) + "_rows"):
                edges[module_of(file)].add(module_of(included))
                edges.setdefault(module_of(included), set())
        if file.endswith(".h"):
            for included in re.findall(r"^[ \t]*#[ \t]*include <([^>]+[/.][^>]*)>", text, re.MULTILINE):
                own = ALLOWED_IN_HEADERS_OF.get(library)
                if not ALLOWED_IN_HEADERS.fullmatch(included) and not (own and own.fullmatch(included)):
                    faults.append(f"{file}: third-party header <{included}> outside a .cpp file")
    for group in circles(edges):
        faults.append(f"{len(group)} modules include each other in a circle: {', '.join(group)}")
    tests = [path.relative_to(root).as_posix() for path in (root / "tests").rglob("*") if path.suffix in (".h", ".cpp", ".py")]
    for folder, count in collections.Counter(file.rpartition("/")[0] for file in files + tests).items():
        if count > MOST_FILES_IN_A_FOLDER:
            faults.append(f"{folder}: {count} source files, more than {MOST_FILES_IN_A_FOLDER}: make folders by subject")
    if len(files) < 10:
        faults.append(f"only {len(files)} files below {root}: not the source folder?")
    print("\n".join(faults) or f"{len(files)} files keep to the architecture")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()

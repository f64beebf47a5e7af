"""Installs PyTorch for the learner's oracle test into the Python that runs this script.

    python tests/oracle/install_torch.py [torch==VERSION]

The package on PyPI is built for CUDA and links to NVIDIA's libraries, which are separate packages of several gigabytes.
The oracle computes on the processor alone, so this installs PyTorch without them and puts an empty library in the place
of each: PyTorch's CPU code is the real thing, and its CUDA functions report that there is no device. Needs gcc and
readelf (Debian: gcc, binutils). Does nothing where PyTorch works already.
"""

import ctypes
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile

INSTALL = pathlib.Path(__file__).with_name("install.sh")
TORCH = "torch==2.15.0"
DEPENDENCIES = ["typing_extensions", "sympy", "mpmath", "networkx", "jinja2", "MarkupSafe", "filelock", "fsspec"]

# a name that never reaches PyTorch's own symbols: prefixes of the functions of NVIDIA's libraries
PREFIXES = {
    "libcuda": r"cu[A-Z]",
    "libcudart": r"(__)?cuda",
    "libcublas": r"cublas(?!Lt)",
    "libcublasLt": r"cublasLt",
    "libcudnn": r"cudnn",
    "libcufft": r"cufft",
    "libcufile": r"cuFile",
    "libcupti": r"cupti",
    "libcurand": r"curand",
    "libcusolver": r"cusolver",
    "libcusparse": r"cusparse(?!Lt)",
    "libcusparseLt": r"cusparseLt",
    "libnccl": r"p?nccl",
    "libnvrtc": r"nvrtc",
    "libnvshmem_host": r"nvshmem",
    "libnvToolsExt": r"nvtx",
}


def works():
    code = "import torch; torch.ones(2, requires_grad=True).sum().backward()"
    return subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


def install(*arguments):
    subprocess.check_call([INSTALL, sys.executable, *arguments])


def readelf(option, library):
    return subprocess.run(["readelf", "-W", option, library], capture_output=True, text=True, check=True).stdout


def loads(name):
    try:
        ctypes.CDLL(name)
        return True
    except OSError:
        return False


def missing_libraries(folder):
    """Names of the libraries that are not there, and the functions wanted from each: {library: {function: version}}."""
    present = {path.name for path in folder.glob("*.so*")}
    wanted, anywhere = {}, set()
    for library in folder.glob("*.so*"):
        for name in re.findall(r"NEEDED.*\[(.*)\]", readelf("--dynamic", library)):
            if name.split(".so")[0] in PREFIXES and name not in present and not loads(name):
                wanted.setdefault(name, {})
        # which library a symbol version belongs to
        owner, versions = None, {}
        for line in readelf("--version-info", library).splitlines():
            if match := re.search(r"File: (\S+)", line):
                owner = match.group(1)
            if match := re.search(r"Name: (\S+)\s+Flags", line):
                versions[match.group(1)] = owner
        for line in readelf("--dyn-syms", library).splitlines():
            fields = line.split()
            if len(fields) < 8 or fields[6] != "UND":
                continue
            function, _, version = fields[7].partition("@")
            version = version.strip("@")
            if version in versions:
                anywhere.add((versions[version], function, version))
            elif not version:
                anywhere.add((None, function, ""))
    for name, functions in wanted.items():
        prefix = re.compile(PREFIXES[name.split(".so")[0]])
        for owner, function, version in sorted(anywhere, key=lambda f: f[2]):
            if owner == name or (owner is None and prefix.match(function)):
                functions[function] = version
    return wanted


def build_empty_library(path, functions):
    """A library whose functions return CUDA's status 'no device', and whose texts are empty."""
    by_version = {}
    for function, version in functions.items():
        by_version.setdefault(version, []).append(function)
    with tempfile.TemporaryDirectory() as folder:
        source, script = pathlib.Path(folder, "empty.c"), pathlib.Path(folder, "versions")
        code = ""
        for function in functions:
            text = re.search(r"String|Name", function)
            code += f"const char *{function}(void) {{ return \"\"; }}\n" if text else f"long {function}(void) {{ return 100; }}\n"
        source.write_text(code)
        command = ["gcc", "-shared", "-fPIC", "-w", "-o", path, source, f"-Wl,-soname,{path.name}"]
        versions = {version: names for version, names in by_version.items() if version}
        if versions:
            script.write_text("".join(f"{v} {{ global: {'; '.join(names)}; }};\n" for v, names in versions.items()))
            command.append(f"-Wl,--version-script={script}")
        subprocess.check_call(command)


def main():
    if works():
        print("PyTorch works")
        return
    if importlib.util.find_spec("torch") is None:
        install("--no-deps", sys.argv[1] if len(sys.argv) > 1 else TORCH)
        importlib.invalidate_caches()
    install(*DEPENDENCIES)
    folder = pathlib.Path(importlib.util.find_spec("torch").origin).parent / "lib"
    for name, functions in missing_libraries(folder).items():
        build_empty_library(folder / name, functions)
    if not works():
        sys.exit("PyTorch was installed but does not run; try 'python -c \"import torch\"' to see why")
    print("PyTorch installed")


if __name__ == "__main__":
    main()

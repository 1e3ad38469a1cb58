"""Builds the package's wheel (PEP 517) with Python's own library. Name, version and dependencies are read from
pyproject.toml."""

import base64
import hashlib
import pathlib
import re
import zipfile

HERE = pathlib.Path(__file__).resolve().parent


def project():
    text = (HERE / "pyproject.toml").read_text()
    value = {key: re.search(rf'^{key} = "(.*)"$', text, re.M)[1] for key in ("name", "version", "description",
                                                                          "requires-python")}
    value["dependencies"] = re.findall('"([^"]+)"', re.search(r"^dependencies = \[(.*)\]$", text, re.M)[1])
    return value


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    of = project()
    stem = f"{of['name']}-{of['version']}"
    metadata = [f"Metadata-Version: 2.1\nName: {of['name']}\nVersion: {of['version']}\nSummary: {of['description']}\n"
                f"Requires-Python: {of['requires-python']}\n", *(f"Requires-Dist: {name}\n" for name in of["dependencies"])]
    files = {f"{of['name']}/{path.name}": path.read_bytes() for path in sorted((HERE / of["name"]).glob("*.py"))}
    files[f"{stem}.dist-info/METADATA"] = "".join(metadata).encode()
    files[f"{stem}.dist-info/WHEEL"] = b"Wheel-Version: 1.0\nGenerator: squeal\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    record = ""
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    files[f"{stem}.dist-info/RECORD"] = f"{record}{stem}.dist-info/RECORD,,\n".encode()
    wheel = f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return wheel

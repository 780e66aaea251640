"""Compilers for a Cortex-M4, with stand-ins for those that are not here."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from swarm_logistics_env.robots import c_sizes


def test_gnu_s_compiler_for_a_cortex_m4_comes_before_ziglang(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name == "ziglang")
    monkeypatch.setattr(shutil, "which", lambda name: name == "arm-none-eabi-gcc")
    gnu = ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard"]
    assert c_sizes.compiler_for_cortex_m4() == [*gnu, "-mfpu=fpv4-sp-d16"]
    monkeypatch.setattr(shutil, "which", lambda _: None)
    target = ["-target", "thumb-linux-musleabihf", "-mcpu=cortex_m4+vfp4d16sp"]
    zig = [sys.executable, "-m", "ziglang", "cc", *target]
    assert c_sizes.compiler_for_cortex_m4() == zig
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert c_sizes.compiler_for_cortex_m4() is None


def test_ziglang_writes_the_stack_where_clang_is_told_to(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def run_compiler(command: Sequence[str], path: Path) -> str:
        if command[0] == "size":
            return "text data bss dec hex filename\n1200 34 5 1239 4d7 part.o\n"
        *_, before, option, within, usage = command
        assert [before, option, within] == ["-Xclang", "-stack-usage-file", "-Xclang"]
        assert "-fstack-usage" not in command
        Path(usage).write_text("robot.c:1:f\t16\tstatic\nrobot.c:9:g\t24\tstatic\n")
        return ""

    monkeypatch.setattr(c_sizes, "run_compiler", run_compiler)
    sizes = c_sizes.sizes_of(tmp_path / "robot.c", ["python", "-m", "ziglang", "cc"])
    assert str(sizes) == "ziglang -mcpu=cortex_m4: 1,234 bytes of flash, at most 40 bytes of stack"


def test_a_compiler_of_gnu_s_has_a_size_of_its_own_and_may_say_nothing_of_the_stack(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    commands: list[list[str]] = []

    def run_compiler(command: Sequence[str], path: Path) -> str:
        commands.append([*command])
        assert path == tmp_path / "robot.c"
        return "text data bss dec hex filename\n1200 34 5 1239 4d7 part.o\n"

    monkeypatch.setattr(c_sizes, "run_compiler", run_compiler)
    compiler = ["/opt/arm-none-eabi-gcc", "-mthumb", "-g"]
    sizes = c_sizes.sizes_of(tmp_path / "robot.c", compiler)
    assert str(sizes) == "arm-none-eabi-gcc -mthumb: 1,234 bytes of flash"
    assert sizes.stack is None
    build, size = commands
    *first, output, usage = build
    assert first == [
        *compiler, *c_sizes.WARNINGS, "-O2", "-c", str(tmp_path / "robot.c"), "-o"
    ]  # fmt: skip
    assert usage == "-fstack-usage"
    assert size == ["/opt/arm-none-eabi-size", output]
    c_sizes.sizes_of(tmp_path / "robot.c", ["/opt/clang"])
    assert commands[-1][0] == "size"

"""Kernels compiled by parts of numba that may change any time: see `numba_fence`.

A kernel is compiled when it is first called, with all that it calls, and kept on disk. LLVM
optimises what another kernel calls there alone, no wrapper is made that nobody uses, files that
were damaged are noticed, and a person hears that compiling takes a while.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import io
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

import numba
from numba.core import config, types
from numba.core.caching import IndexDataCacheFile, NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock

from swarm_logistics_env.compiler.numba_fence import is_worker

if TYPE_CHECKING:
    from rich.progress import Progress

P = ParamSpec("P")
R = TypeVar("R")

_CHECKSUM_SIZE = 16  # bytes
_SILENCE = 1.0  # [s] of compiling that nobody is told of
_PACKAGE = Path(__file__).parents[1]
# Where kernels stand, and what they take from.
_SOURCES = ("compiler/*.py", "world/**/*.py", "environment/*.py", "policies/*.py", "train/*.py")
_all_kernels: list[Any] = []
_parts: dict[Any, set[Any]] = {}  # by kernel, the signatures that Python cannot call
_config, _types = cast("tuple[Any, Any]", (config, types))  # without types


def compile_fast(function: Callable[P, R], *, is_inlined: bool) -> Callable[P, R]:
    """Compile `function` with numba; `is_inlined`: as a part of the kernels that call it."""
    # Nobody calls a kernel from C.
    options: dict[str, Any] = {"forceinline": is_inlined, "no_cfunc_wrapper": True}
    compiled: Any = numba.njit(function, nogil=True, error_model="numpy", **options)
    if not _config.DISABLE_JIT:
        compiled.get_call_template = functools.partial(_call_template, compiled)
        compiled.compile = functools.partial(_compile, compiled)
        _all_kernels.append(compiled)
    return cast("Callable[P, R]", compiled)


def _call_template(compiled: Any, args: tuple[Any, ...], named: dict[str, Any]) -> Any:
    # A number that stands in the code is no type of its own, or each would be compiled for.
    plain = tuple(_types.unliteral(kind) for kind in args)
    return type(compiled).get_call_template(compiled, plain, named)


def _compile(compiled: Any, signature: Any) -> Any:
    """Compile a kernel for a signature, or load it: with all that it calls, if Python calls it."""
    compile_now = functools.partial(type(compiled).compile, compiled, signature)
    with global_compiler_lock:
        if _Report.current is not None:
            if signature not in compiled.overloads:
                _compile_as_part(compiled, compile_now)
                _Report.current.tell()
            return compile_now()
        if signature in _parts.get(compiled, ()):
            _parts[compiled].remove(signature)
            del compiled.overloads[signature]  # Python cannot call what is only a part
        if signature in compiled.overloads:
            return compile_now()
        _import_without_blas()
        with _with_cache(compiled), _Report():
            return compile_now()


@functools.cache
def _import_without_blas() -> None:
    """Import numba's functions of arrays, which else import scipy's BLAS first, for .15 s.

    They only ask whether it is there. A kernel of somebody else that needs it imports it then.
    """
    blas = "scipy.linalg.cython_blas"
    if blas not in sys.modules:
        sys.modules[blas] = ModuleType(blas)
        try:
            importlib.import_module("numba.np.arraymath")
        finally:
            del sys.modules[blas]


def _compile_as_part(compiled: Any, compile_now: Callable[[], Any]) -> None:
    """Compile what another kernel calls: LLVM is to optimise it there alone, not before as well."""
    compiler = compiled._compiler
    cache = compiled._cache
    signatures_before = set(compiled.overloads)
    compiler.pipeline_class = _PartCompiler
    compiled._insert = lambda *_: None
    compiled._cache = NullCache()
    try:
        compile_now()
    finally:
        compiler.pipeline_class = Compiler
        compiled._cache = cache
        del compiled._insert
        signatures = set(compiled.overloads) - signatures_before
        _parts.setdefault(compiled, set()).update(signatures)


class _PartCompiler(Compiler):
    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)  # type: ignore[no-untyped-call]  # numba's
        state, part = cast("tuple[Any, Any]", (self.state, _PartLibrary))
        state.library = part(state.targetctx.codegen(), "part")
        state.flags.no_cpython_wrapper = True


class _PartLibrary(JITCodeLibrary):
    """Code that is only linked into that of others: no machine code is made of it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        library: Any = self
        library._finalize_dynamic_globals()
        library._verify_declare_only_symbols()
        library._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return that there is no machine code."""
        return 0

    @property
    def codegen(self) -> Any:
        """What makes machine code: nobody keeps constants of Python there, which kernels lack."""
        return _NoEnvironments()


class _NoEnvironments:
    def set_env(self, *_: object) -> None:
        pass


@contextlib.contextmanager
def _with_cache(compiled: Any) -> Iterator[None]:
    """Let numba load what is compiled, or keep it, while no other process does."""
    if not compiled.stats.cache_path:
        try:
            compiled.enable_caching()
        except RuntimeError:
            # Neither the installation nor the user's own folder can be written.
            _warn_of_no_cache("no folder can be written")
            yield
            return
        cache = compiled._cache
        cache.save_overload = functools.partial(_save_overload, cache)
        # numba looks at the kernel's own file alone, not at what it takes from others.
        is_ours = Path(compiled.py_func.__code__.co_filename).is_relative_to(_PACKAGE)
        stamp = (_digest(), None if is_ours else cache._impl.locator.get_source_stamp())
        cache._cache_file = _CheckedFiles(  # type: ignore[no-untyped-call]  # numba's
            cache.cache_path, f"{cache._impl.filename_base}.checked", stamp
        )
    from filelock import FileLock

    folder = Path(compiled.stats.cache_path)
    with contextlib.ExitStack() as locks:
        # A file system may know no locks: then two processes may compile the same.
        with contextlib.suppress(OSError, NotImplementedError):
            folder.mkdir(parents=True, exist_ok=True)
            locks.enter_context(FileLock(folder / "swarm_logistics_env.lock"))
        yield


def _save_overload(cache: Any, signature: Any, result: Any) -> None:
    try:
        type(cache).save_overload(cache, signature, result)
    except OSError as error:
        _warn_of_no_cache(str(error.strerror or error))


class _CheckedFiles(IndexDataCacheFile):
    """numba's files of a kernel, with a digest at the end of each, which numba does not read.

    Code that was damaged is compiled again. So is code of other sources or another signature:
    where a full disk took the index, but not the code, an older file has its name.
    """

    is_told = False  # in this process

    def save(self, key: Any, data: Any) -> None:
        super().save(key, (self._source_stamp, key, data))  # type: ignore[no-untyped-call]

    def load(self, key: Any) -> Any:
        *stamp_and_key, data = super().load(key) or [None]  # type: ignore[no-untyped-call]
        return data if stamp_and_key == [self._source_stamp, key] else None

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue() + _checksum(content.getvalue()))

    def _load_index(self) -> Any:
        if not self._is_sound(self._index_path):
            return {}
        try:
            return super()._load_index()  # type: ignore[no-untyped-call]
        except (AttributeError, ImportError):  # of another version, which had other structures
            return {}

    def _load_data(self, name: str) -> Any:
        is_sound = self._is_sound(self._data_path(name))  # type: ignore[no-untyped-call]
        return super()._load_data(name) if is_sound else None  # type: ignore[no-untyped-call]

    def _is_sound(self, path: str) -> bool:
        """Return whether a file is as it was written, or none; else remove it and tell once."""
        try:
            content = Path(path).read_bytes()
        except FileNotFoundError:
            return True
        except OSError:
            content = b""
        if content[-_CHECKSUM_SIZE:] == _checksum(content[:-_CHECKSUM_SIZE]):
            return True
        with contextlib.suppress(OSError):
            Path(path).unlink()
        if not _CheckedFiles.is_told:
            _CheckedFiles.is_told = True
            warnings.warn(f"{path}: compiled code was damaged, so it is made again", stacklevel=8)
        return False


def _checksum(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=_CHECKSUM_SIZE).digest()


@functools.cache
def _digest() -> str:
    """Return a digest of the files whose code kernels are made of."""
    digest = hashlib.blake2b(digest_size=8)
    for pattern in _SOURCES:
        for file in sorted(_PACKAGE.glob(pattern)):
            digest.update(file.read_bytes())
    return digest.hexdigest()


class _Report:
    """Tells a person once that kernels are being compiled, and how many are, with a bar."""

    current: _Report | None = None
    is_told = False  # in this process
    bar: Progress | None = None  # of this process, at a terminal, once a person was told
    seconds = 0.0  # of the reports before

    def __enter__(self) -> None:
        self._start = time.monotonic()
        _Report.current = self

    def __exit__(self, *_: object) -> None:
        _Report.current = None
        _Report.seconds += time.monotonic() - self._start
        if self.bar is not None:
            self.bar.stop()

    def tell(self) -> None:
        """Tell a person who has been waiting how many kernels are compiled."""
        seconds = self.seconds + time.monotonic() - self._start
        if is_worker() or seconds < _SILENCE:
            return
        if not _Report.is_told:
            _Report.is_told = True
            sys.stderr.write("Compiling, which later runs reuse: up to 15 s of a free core.\n")
            if sys.stderr.isatty():
                from rich.console import Console
                from rich.progress import Progress

                _Report.bar = Progress(console=Console(stderr=True), transient=True)
                _Report.bar.add_task("Compiling", total=len(_all_kernels))
        if self.bar is not None:
            n_done = sum(bool(compiled.overloads) for compiled in _all_kernels)
            self.bar.update(self.bar.task_ids[0], completed=n_done)
            self.bar.start()


@functools.cache
def _warn_of_no_cache(reason: str) -> None:
    warnings.warn(
        f"compiled code cannot be kept ({reason}), so every process compiles for itself, which "
        "takes up to 15 seconds: set NUMBA_CACHE_DIR to a folder that can be written",
        stacklevel=8,
    )

"""Generated C as WebAssembly, written without a compiler into a module that was compiled before."""

from __future__ import annotations

from kinfmu.codegen.wasm.binary import Binary
from kinfmu.codegen.wasm.translate import Translator

__all__ = ["Binary", "Translator"]

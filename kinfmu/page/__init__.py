"""A mechanism as a page of a browser, which moves it with the C of its native FMU, compiled to WebAssembly."""

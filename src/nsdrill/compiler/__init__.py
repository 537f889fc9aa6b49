"""The compiler of lane functions: a restricted Python (:mod:`.language`) to vector
instructions, by one walk over the syntax tree (:mod:`.expressions`, :mod:`.calls`,
:mod:`.statements`), which writes a module of LLVM (:mod:`.ir`), of which LLVM makes
machine code (:mod:`.native`), or the code of one thread of a GPU (:mod:`.threads`).
:mod:`.functions` is the way in."""

"""The stub and the module agree: names, parameters, docstrings."""

from __future__ import annotations

import ast
import inspect
import unittest
from pathlib import Path
from typing import Iterator

import gs_chroma

STUB = Path(gs_chroma.__file__).with_suffix(".pyi")
DEFINITIONS = (ast.ClassDef, ast.FunctionDef)


def documented(body: list[ast.stmt]) -> Iterator[tuple[str, ast.stmt, str | None]]:
    """Names of a body with their statements and docstrings."""
    for statement, after in zip(body, [*body[1:], None]):
        if isinstance(statement, DEFINITIONS):
            yield statement.name, statement, ast.get_docstring(statement)
        elif isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            yield statement.target.id, statement, after.value.value if is_text else None


def words(text: str | None) -> list[str]:
    """The words of a docstring, without marks of code."""
    return (text or "").replace("`", "").split()


class Stub(unittest.TestCase):
    """Every name of the stub."""

    def compare(self, name: str, statement: ast.stmt, text: str | None, thing: object) -> None:
        if text is not None:
            self.assertEqual(words(text), words(inspect.getdoc(thing)), name)
        if isinstance(statement, ast.FunctionDef) and statement.name != "__init__":
            arguments = statement.args
            wanted = [a.arg for a in (*arguments.args, *arguments.kwonlyargs) if a.arg != "self"]
            found = inspect.signature(thing).parameters.values()
            named = [p.name for p in found if p.kind is not p.VAR_KEYWORD and p.name != "self"]
            self.assertEqual(wanted, named, name)
            takes_more = any(p.kind is p.VAR_KEYWORD for p in found)
            self.assertEqual(arguments.kwarg is not None, takes_more, name)

    def test_names_parameters_and_docstrings(self) -> None:
        count = 0
        for name, statement, text in documented(ast.parse(STUB.read_text(encoding="utf-8")).body):
            if name.startswith("_") or isinstance(statement, ast.AnnAssign):
                continue
            is_class = isinstance(statement, ast.ClassDef)
            if is_class and any(getattr(base, "id", "") == "TypedDict" for base in statement.bases):
                continue
            thing = getattr(gs_chroma, name)
            self.compare(name, statement, text, thing)
            for member, inner, text in documented(statement.body if is_class else []):
                found = inspect.getattr_static(thing, member)
                found = getattr(thing, member) if isinstance(found, staticmethod) else found
                self.compare(f"{name}.{member}", inner, text, found)
                count += 1
        self.assertGreater(count, 50)

    def test_all_names_are_in_the_stub(self) -> None:
        names = {name for name, _, _ in documented(ast.parse(STUB.read_text(encoding="utf-8")).body)}
        self.assertLessEqual(set(gs_chroma.__all__), names)


if __name__ == "__main__":
    unittest.main()

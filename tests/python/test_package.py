"""The package: names, documentation and types."""
import ast
import inspect
import pathlib

import lowlux

STUB = pathlib.Path(lowlux.__file__).resolve().with_name("__init__.pyi")


def stub():
    return ast.parse(STUB.read_text())


def test_every_public_name_is_documented_and_has_a_type():
    typed = {node.name for node in stub().body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    typed |= {alias.asname for node in stub().body if isinstance(node, ast.ImportFrom) for alias in node.names}
    for name in lowlux.__all__:
        if name == "__version__":
            continue
        assert inspect.getdoc(getattr(lowlux, name)), name
        assert name in typed
    assert STUB.with_name("py.typed").exists()


def test_the_types_are_of_the_arguments_there_are():
    functions = {node.name: node for node in stub().body if isinstance(node, ast.FunctionDef)}
    assert len(functions) == 10
    for name, node in functions.items():
        parameters = inspect.signature(getattr(lowlux, name)).parameters.values()
        of_kind = lambda *kinds: [p.name for p in parameters if p.kind in kinds]
        assert [a.arg for a in node.args.args] == of_kind(inspect.Parameter.POSITIONAL_OR_KEYWORD), name
        assert [a.arg for a in node.args.kwonlyargs] == of_kind(inspect.Parameter.KEYWORD_ONLY), name


def test_the_types_are_of_the_attributes_there_are(night):
    classes = {node.name: node for node in stub().body if isinstance(node, ast.ClassDef)}
    made = {"RawImage": lowlux.read_raw(night), "Developed": lowlux.develop(night, half=True),
            "Denoised": lowlux.denoise(night), "Simulated": lowlux.simulate("flat", size=(32, 32)),
            "Profile": lowlux.calibrate("quoted", "thesis")}
    for name, value in made.items():
        for item in classes[name].body:
            attribute = item.name if isinstance(item, ast.FunctionDef) else item.target.id
            assert hasattr(value, attribute), (name, attribute)
    public = {name for name in dir(made["RawImage"]) if not name.startswith("_")}
    assert public == {item.name for item in classes["RawImage"].body}

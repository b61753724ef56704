"""Writes `src/retina_client/messages.py` from the service's OpenAPI document: `python3 generate_messages.py [URL]`.

Reads `URL/openapi.json` (http://127.0.0.1:8080 when left out), or the document itself from standard input where URL is `-`, and then writes to
standard output. Every schema becomes a `TypedDict` or a name for a union; the schemas' descriptions become documentation.
"""

from __future__ import annotations

import json
import pathlib
import sys
import textwrap
import urllib.request
from typing import Any

Schema = dict[str, Any]

HEAD = '''"""The messages of the service, as `/openapi.json` has them. Written by `generate_messages.py`: change nothing here."""

from __future__ import annotations

from typing import Any, Dict, List, Literal, Optional, TypedDict, Union
'''
WORDS = {"number": "float", "integer": "int", "string": "str", "boolean": "bool", "null": "None"}


def reference(schema: Schema) -> str:
    """The type that stands for a schema."""
    if "$ref" in schema:
        name: str = schema["$ref"].rsplit("/", 1)[1]
        return f'"{name}"'
    if "oneOf" in schema:
        return union([reference(one) for one in schema["oneOf"]])
    if "enum" in schema:
        return "Literal[" + ", ".join(json.dumps(word) for word in schema["enum"]) + "]"
    kind = schema.get("type")
    if isinstance(kind, list):
        return union([reference({**schema, "type": one}) for one in kind])
    if kind == "array":
        return f"List[{reference(schema['items'])}]"
    if kind == "object":
        return f"Dict[str, {reference(schema.get('additionalProperties', {}))}]"
    return WORDS.get(str(kind), "Any")


def union(names: list[str]) -> str:
    some = [name for name in names if name != "None"]
    inner = some[0] if len(some) == 1 else "Union[" + ", ".join(some) + "]"
    return inner if len(some) == len(names) else f"Optional[{inner}]"


def documentation(text: str, indent: str) -> list[str]:
    lines = textwrap.wrap(" ".join(text.split()).replace("\\", "\\\\"), 110)
    if len(lines) == 1:
        return [f'{indent}"""{lines[0]}"""']
    return [f'{indent}"""{lines[0]}'] + [indent + line for line in lines[1:]] + [f'{indent}"""'] if lines else []


def fields(schema: Schema, names: list[str]) -> list[str]:
    lines: list[str] = []
    for name in names:
        field = schema["properties"][name]
        lines.append(f"    {name}: {reference(field)}")
        lines += documentation(field.get("description", ""), "    ")
    return lines


def dictionary(name: str, schema: Schema) -> list[str]:
    """A `TypedDict`, its required fields in a class of their own where there are others."""
    properties = list(schema.get("properties", {}))
    required = [field for field in properties if field in schema.get("required", [])]
    optional = [field for field in properties if field not in required]
    about = documentation(schema.get("description", ""), "    ")
    if not optional:
        return [f"class {name}(TypedDict):"] + about + fields(schema, required)
    lines: list[str] = []
    base = "TypedDict"
    if required:
        base = f"_{name}Required"
        lines = [f"class {base}(TypedDict):"] + fields(schema, required) + ["", ""]
    return lines + [f"class {name}({base}, total=False):"] + about + fields(schema, optional)


def definition(name: str, schema: Schema) -> list[str]:
    if "properties" in schema:
        return dictionary(name, schema)
    lines: list[str] = []
    names: list[str] = []
    for one in schema.get("oneOf", []):
        if list(one.get("properties", [])) == one.get("required") and len(one["properties"]) == 1:
            variant = name + one["required"][0].title().replace("_", "")
            lines += dictionary(variant, one) + ["", ""]
            names.append(f'"{variant}"')
        else:
            names.append(reference(one))
    about = documentation(schema.get("description", ""), "")
    return lines + [f"{name} = {union(names) if names else reference(schema)}"] + about


def types(document: Schema) -> str:
    """The text of `messages.py`."""
    schemas = document["components"]["schemas"]
    # A name for a union names others as text, so the order does not matter; sorted, it never changes by itself.
    parts = ["\n".join(definition(name, schemas[name])) for name in sorted(schemas)]
    return HEAD + "\n\n" + "\n\n\n".join(parts) + "\n"


def main() -> None:
    url = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080"
    if url == "-":
        sys.stdout.reconfigure(encoding="utf-8", newline="\n")  # type: ignore[union-attr]
        sys.stdout.write(types(json.load(sys.stdin.buffer)))
        return
    with urllib.request.urlopen(f"{url}/openapi.json") as response:
        text = types(json.load(response))
    place = pathlib.Path(__file__).parent / "src" / "retina_client" / "messages.py"
    place.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()

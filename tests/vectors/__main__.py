"""`python -m tests.vectors` rewrites the golden vectors, `proto/asyncapi.json` and the TypeScript message types."""

from tests.vectors import arm, golden

for path, text in golden.render_files().items():
    path.write_text(text, encoding="utf-8")
    print(path)
arm.write_vectors()
print(arm.VECTORS_FILE)

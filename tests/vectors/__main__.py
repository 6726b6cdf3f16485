"""`python -m tests.vectors` writes every golden file anew."""

from tests.vectors import arm, golden

for name, text in golden.render_files().items():
    (golden.VECTORS_FOLDER / name).write_text(text, encoding="utf-8")
    print(golden.VECTORS_FOLDER / name)
arm.write_vectors()
print(arm.VECTORS_FILE)

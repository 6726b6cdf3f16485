"""`python -m tests.vectors` writes every golden file anew."""

from tests.vectors import arm, golden

for name, text in golden.files().items():
    (golden.FOLDER / name).write_text(text, encoding="utf-8")
    print(golden.FOLDER / name)
arm.write()
print(arm.FILE)

"""The comparisons of fuzz.py --new find a wrong table: each kind of model is run, compared, and compared again with a table in
which one number or one line is false."""

import pathlib
import random
import sys
import unittest

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / folder) for folder in ("lib", "fuzz")]

import compared  # noqa: E402
import squeal_testing as st  # noqa: E402


class Falsified(st.TestCase):
    def accepted(self, kind):
        """The first model of a kind all of whose runs end well, and the directory of its results."""
        for number in range(20):
            model = kind(random.Random(f"compared-{number}"))
            directory = self.directory / f"{kind.__name__}-{number}"
            directory.mkdir()
            for name, data in model.files.items():
                (directory / name).write_bytes(data)
            if all(st.run(*arguments, directory=directory).returncode == 0 for arguments in (model.first, *model.others)):
                return model, directory
        self.fail("no model is accepted")

    def changed(self, path, share):
        """Tables with a false growth rate, a false frequency, a line less and a line twice, {what: text}. The line is one in
        the middle of the window."""
        lines = path.read_text().splitlines()
        names = lines[0].split(",")
        rows = [dict(zip(names, line.split(","))) for line in lines[1:]]
        k = min((k for k, row in enumerate(rows) if row["growth_rate_1_per_s"]),
                key=lambda k: abs(float(rows[k]["frequency_hz"]) - float(rows[-1]["frequency_hz"]) / 2))
        row, cells = rows[k], lines[k + 1].split(",")
        wrong = share * 6.3 * float(row["frequency_hz"]) * max(1., float(row.get("condition_number") or 1))

        def with_cell(column, change):
            at = names.index(column)
            return [*cells[:at], repr(float(cells[at]) + change), *cells[at + 1:]]

        tables = {"growth rate": [lines[:k + 1], [",".join(with_cell("growth_rate_1_per_s", wrong))], lines[k + 2:]],
                  "line less": [lines[:k + 1], lines[k + 2:]], "line twice": [lines[:k + 2], lines[k + 1:]]}
        if path.name != "samples.csv":  # whose frequencies are not compared
            tables["frequency"] = [lines[:k + 1], [",".join(with_cell("frequency_hz", wrong / 6.2))], lines[k + 2:]]
        return {what: "\n".join(sum(parts, [])) + "\n" for what, parts in tables.items()}

    def test_every_kind(self):
        for kind in compared.KINDS:
            with self.subTest(kind.__name__):
                model, directory = self.accepted(kind)

                def wrong(ended=None):
                    return model.compare(directory, ended or {}) if model.of_a_study else model.compare(directory)

                self.assertEqual(wrong(), "")
                results = directory / "output/first"
                path = next(results / f"{name}.csv" for name in ("samples", "sweep", "modes") if (results / f"{name}.csv").exists())
                text = path.read_text()
                # Ten times what an eigenvalue may differ, twice what the fit of a table may move it
                share = 2e-2 if kind is compared.modulus_table else 1e-5
                for what, table in self.changed(path, share).items():
                    path.write_text(table)
                    self.assertTrue(wrong(), f"a false {what} is not found")
                path.write_text(text)
                if model.of_a_study:
                    self.assertIn("alone it is refused", wrong({1: "exit 2"}))
                    self.assertEqual(wrong({1: "exit 3"}), "")


if __name__ == "__main__":
    unittest.main(verbosity=2)

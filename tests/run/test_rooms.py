"""The order of the rooms: a folder of source/ and include/squeal/ includes only from itself and from those before it."""

import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "lib"))

import squeal_testing as st  # noqa: E402

ROOMS = ("base linalg parameters "            # ground
         "mesh mesh_files scenes "            # shape
         "equations projection eigen "        # language
         "bodies contact joints statics model "  # mechanics
         "assessment reduction bars studies run").split()  # answers


class Rooms(unittest.TestCase):
    def test_order(self):
        files = [*st.PROJECT.glob("source/*/*.cc"), *st.PROJECT.glob("include/squeal/*/*.h")]
        self.assertEqual({file.parent.name for file in files}, set(ROOMS))
        errors = [f"{file.parent.name}/{file.name} includes {room}/{name}"
                  for file in files
                  for room, name in re.findall(r'#\s*include\s+[<"](?:squeal/)?(\w+)/(\w+\.h)[>"]', file.read_text())
                  if room in ROOMS and ROOMS.index(room) > ROOMS.index(file.parent.name)]
        self.assertFalse(errors, "\n".join(errors))
        corridor = [*st.PROJECT.glob("source/*.cc"), *st.PROJECT.glob("include/squeal/*.h")]
        self.assertEqual([file.name for file in corridor], ["main.cc"])


if __name__ == "__main__":
    unittest.main(verbosity=2)

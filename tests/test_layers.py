"""The house rules of the C++ code: which file may include which, and how long a file may be."""

import re
import unittest

import squeal_testing as st

# A file includes only from lower floors. A new file gets a place here: the lowest floor on which it can stand.
FLOORS = [
    ["cell_kernels", "errors", "search_region"],
    ["interruption", "memory", "rank_group", "stopwatch"],
    ["materials", "friction_laws", "log"],
    ["expressions", "dense", "mesh_file", "files"],
    ["parameters", "linear_algebra", "gmsh_file", "abaqus_file"],
    ["borrowed_vector", "compressed_rows", "parameter_file", "sweep_parameters", "refinement_parameters", "eigenproblem_parameters", "mesh_parameters", "material_parameters", "geometry", "matrix_market", "mortar", "self_locking"],
    ["eigenproblem", "sparse_products", "constraint_projection"],
    ["gmres"],
    ["spaces", "material_operator", "mesh_checks", "reduced_tools"],
    ["mesh_scene"],
    ["mesh_report"],
    ["mirror", "cell_operators", "cell_map", "cell_residuals", "contact_pairs", "fields", "prestress", "reference_count"],
    ["body_operators", "displacement_operator", "half_space"],
    ["contact", "displacement_multigrid"],
    ["contact_border", "direct_statics", "iterative_statics"],
    ["contact_fields", "local_problems", "friction_work", "contact_set", "kept_contact", "static_equilibrium", "subspace_iteration"],
    ["block_krylov", "pep_search"],
    ["left_vectors"],
    ["window_search", "block_davidson"],
    ["eigensolvers", "model", "reduced_model"],
    ["half_problems", "reduced_halves", "stability", "divergence", "brake_model", "matrix_model"],
    ["brake_derivatives", "brake_matrix_free", "modes_without_factors", "reduced_projection", "reduced_pairs", "reduced_modes", "branches", "error_bounds"],
    ["error_estimators"],
    ["output", "static_report", "mode_follower"],
    ["sweep", "convergence", "refinement", "refinement_record"],
    ["stability_map"],
    ["analysis"],
    ["brake_squeal"],
    ["main"],
]
LONGEST_FILE = 600


class Layers(unittest.TestCase):
    def test_includes(self):
        floor = {name: number for number, names in enumerate(FLOORS) for name in names}
        files = sorted([*st.PROJECT.glob("source/*.cc"), *st.PROJECT.glob("include/squeal/*.h")])
        self.assertTrue(files)
        errors = []
        for file in files:
            if file.stem not in floor:
                errors.append(f"{file.name} has no place in the table of floors.")
                continue
            text = file.read_text()
            for name in re.findall(r'^\s*#\s*include\s+"(.*)"', text, re.MULTILINE):
                errors.append(f'{file.name}: write #include <squeal/...>, not "{name}".')
            for name in re.findall(r"^\s*#\s*include\s+<squeal/(\w+)\.h>", text, re.MULTILINE):
                if name not in floor:
                    errors.append(f"{file.name} includes {name}.h, which has no place in the table of floors.")
                elif floor[name] >= floor[file.stem] and name != file.stem:
                    errors.append(f"{file.name} (floor {floor[file.stem]}) includes {name}.h (floor {floor[name]}).")
        self.assertFalse(errors, "\n".join(errors))

    def test_length(self):
        files = [file for pattern in ["source/*.cc", "include/squeal/*.h", "tests/unit/*.cc", "tests/unit/*.h"]
                 for file in st.PROJECT.glob(pattern)]
        long = {str(file.relative_to(st.PROJECT)): n for file in files if (n := len(file.read_text().splitlines())) > LONGEST_FILE}
        self.assertFalse(long, f"longer than {LONGEST_FILE} lines: {long}")


if __name__ == "__main__":
    unittest.main(verbosity=2)

#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/base/errors.h>
#include <squeal/parameters/parameter_file.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
namespace squeal::tests::parameter_file_tests
{
  namespace
  {
    std::unique_ptr<ParameterFile> read(const std::string &text,
                                        const std::vector<std::string> &overrides = {})
    {
      const TemporaryFile temporary(text, "prm");
      auto file = std::make_unique<ParameterFile>();
      file->read(temporary.name, overrides);
      return file;
    }

    /// The message of the error, with the file's name as FILE.
    std::string error_of(const std::string &text, const std::vector<std::string> &overrides = {})
    {
      const TemporaryFile temporary(text, "prm");
      std::string message = message_of<InputError>(
          [&]()
          {
            ParameterFile file;
            file.read(temporary.name, overrides);
          });
      const std::size_t place = message.find(temporary.name);
      if (place != std::string::npos)
        message.replace(place, temporary.name.size(), "FILE");
      return message;
    }

    void check_error(const std::string &text, const std::vector<std::string> &overrides,
                     const std::vector<std::string> &parts)
    {
      const std::string message = error_of(text, overrides);
      CAPTURE(message);
      for (const std::string &part : parts)
      {
        CAPTURE(part);
        CHECK(contains(message, part));
      }
    }
  } // namespace

  TEST_CASE("parameter_file: the defaults are those that interface.md promises")
  {
    const Parameters::All p = ParameterFile().parameters();
    CHECK(p.scene == Scene::brake);
    CHECK(p.stage == Stage::full);
    CHECK(p.rotor.inner_radius == 0.05);
    CHECK(p.rotor.outer_radius == 0.15);
    CHECK(p.rotor.thickness == 0.012);
    CHECK(p.rotor.clamped == Clamped::inner);
    CHECK(p.rotor.material.young_modulus == 1.25e11);
    CHECK(p.rotor.material.poisson_ratio == 0.25);
    CHECK(p.rotor.material.density == 7200);
    CHECK(p.rotor.material.mass_damping == 0);
    CHECK(p.rotor.material.stiffness_damping == 1e-7);
    CHECK(p.pads.arrangement == Arrangement::both);
    CHECK(p.pads.inner_radius == 0.09);
    CHECK(p.pads.outer_radius == 0.14);
    CHECK(p.pads.sector_angle == 50);
    CHECK(p.pads.thickness == 0.012);
    CHECK(p.pads.back_face == BackFace::guided);
    CHECK(p.pads.pressure == 1e6);
    CHECK(p.pads.material.young_modulus == 1e10);
    CHECK(p.pads.material.poisson_ratio == 0.3);
    CHECK(p.pads.material.density == 2500);
    CHECK(p.pads.material.mass_damping == 0);
    CHECK(p.pads.material.stiffness_damping == 2e-6);
    CHECK(p.operation.angular_velocity == 20);
    CHECK(p.contact.formulation == Formulation::mortar);
    CHECK(p.contact.penalty_stiffness == 1e12);
    CHECK(p.contact.steady_pressure == SteadyPressure::computed);
    CHECK(p.contact.friction.kind == FrictionLaw::Kind::constant);
    CHECK(p.contact.friction.coefficient == 0.6);
    CHECK(p.discretization.degree == 3);
    CHECK(p.discretization.rotor_cells == std::array<unsigned int, 3>{{5, 36, 1}});
    CHECK(p.discretization.pad_cells == std::array<unsigned int, 3>{{3, 6, 1}});
    CHECK(p.refinement.strategy == Strategy::none);
    CHECK(p.refinement.cycles == 1);
    CHECK(p.refinement.tolerance == 1e-3);
    CHECK(p.refinement.maximum_unknowns == 500000);
    CHECK(p.eigenproblem.maximum_frequency == 6000);
    CHECK(p.eigenproblem.solver == ModeSolver::block_krylov);
    CHECK(p.eigenproblem.tolerance == 1e-9);
    CHECK(p.sweep.parameter == "none");
    CHECK(p.sweep.values == "");
    CHECK(p.matrices.mass == "");
    CHECK(p.matrices.velocity == "");
    CHECK(p.matrices.stiffness == "");
    CHECK(p.matrices.circulatory == "");
    CHECK(p.matrices.circulatory_factor == 1);
    CHECK(p.output.directory == "");

    // The defaults are valid: an empty file is accepted.
    CHECK(error_of("") == "");
  }

  TEST_CASE("parameter_file: values of a file, comments, nested sections")
  {
    const auto file =
        read("# a comment\n"
             "set Stage = transport   # another\n"
             "subsection Rotor\n"
             "  subsection Material\n"
             "\tset Young modulus=2e11\n"
             "  end\n"
             "  set Thickness = 0.02\r\n"
             "end\n"
             "subsection Discretization\n"
             "  set Rotor cells = 2, 12, 3\n"
             "end\n"
             "subsection Contact\n  subsection Friction\n    set Law = falling\n  end\nend\n");
    const Parameters::All &p = file->parameters();
    CHECK(p.stage == Stage::transport);
    CHECK(p.rotor.material.young_modulus == 2e11);
    CHECK(p.rotor.material.poisson_ratio == 0.25); // a neighbour keeps its default
    CHECK(p.pads.material.young_modulus == 1e10);  // and so does the key of that name elsewhere
    CHECK(p.rotor.thickness == 0.02);
    CHECK(p.discretization.rotor_cells == std::array<unsigned int, 3>{{2, 12, 3}});
    CHECK(p.contact.friction.kind == FrictionLaw::Kind::falling);
  }

  TEST_CASE("parameter_file: a backslash continues a line, and lines keep their numbers")
  {
    const auto file = read("subsection Sweep\n"
                           "  set Parameter = Pads/Pressure\n"
                           "  set Values = 1e6, \\\n"
                           "     2e6, \\  # the second\n"
                           "     3e6\n"
                           "end\n"
                           "set Stage = full \\");
    CHECK(file->parameters().sweep.points() == std::vector<double>{1e6, 2e6, 3e6});
    check_error("set Stage = \\\n full\nset Stag = full\n", {}, {"FILE:3", "Stag"});
    check_error("set Stage = \\\n half\n", {}, {"FILE:1", "half"});
  }

  TEST_CASE("parameter_file: overrides come last and reach every section")
  {
    const auto file = read("set Stage = elastic\nsubsection Pads\n  set Pressure = 3\nend\n",
                           {"Stage=friction", " Contact/Friction/Coefficient = 0.25",
                            "Pads/Material/Density=1000", "Output/Directory=a=b"});
    const Parameters::All &p = file->parameters();
    CHECK(p.stage == Stage::friction);
    CHECK(p.contact.friction.coefficient == 0.25);
    CHECK(p.pads.material.density == 1000);
    CHECK(p.pads.pressure == 3);
    CHECK(p.output.directory == "a=b"); // only the first = separates

    // The later of two overrides wins.
    CHECK(read("", {"Pads/Pressure=1", "Pads/Pressure=2"})->parameters().pads.pressure == 2);
  }

  TEST_CASE("parameter_file: an unknown key names file, line, and the nearest known key")
  {
    check_error("set Stage = full\nsubsection Rotor\n  set Tickness = 0.01\nend\n", {},
                {"FILE:3", "unknown key 'Rotor/Tickness'", "'Rotor/Thickness'"});
    // In the wrong section: the key itself counts more than its path.
    check_error("set Maximum frequency = 100\n", {},
                {"FILE:1", "'Eigenproblem/Maximum frequency'"});
    check_error("subsection Contact\n  set Coefficient = 0.3\nend\n", {},
                {"FILE:2", "'Contact/Coefficient'", "'Contact/Friction/Coefficient'"});
    // Wrong capitals are an unknown key, whose nearest one differs by capitals only.
    check_error("subsection rotor\n  set thickness = 0.01\nend\n", {},
                {"FILE:2", "'Rotor/Thickness'"});
    // What is alike in the same section counts more than what is alike elsewhere.
    check_error("subsection Output\n  set Matrces = true\nend\n", {},
                {"FILE:2", "'Output/Matrices'"});
    // Where nothing is spelt alike, what the section has, and no key that has nothing to do with
    // it.
    check_error("subsection Rotor\n  subsection Material\n    set Colour = 1\n  end\nend\n", {},
                {"FILE:3",
                 "None is spelt alike. The section Rotor/Material has: Law, Axis, Young modulus"});
    // In an override.
    check_error("", {"Operation/Angular velocty=3"},
                {"--set \"Operation/Angular velocty=3\"", "'Operation/Angular velocity'"});
  }

  TEST_CASE(
      "parameter_file: a value that its pattern forbids names line, key, value and what is allowed")
  {
    check_error("set Stage = fool\n", {},
                {"FILE:1", "Stage = fool", "elastic", "friction_damping"});
    check_error("subsection Rotor\n  set Thickness = -1\nend\n", {},
                {"FILE:2", "Rotor/Thickness = -1", "0 (excluded)", "infinity",
                 "Thickness of the disc, m."});
    check_error("subsection Rotor\n  set Thickness = 0\nend\n", {},
                {"FILE:2", "Rotor/Thickness = 0"});
    check_error("subsection Pads\n  set Pressure = much\nend\n", {},
                {"FILE:2", "Pads/Pressure = much"});
    check_error("subsection Pads\n  set Pressure = nan\nend\n", {},
                {"FILE:2", "Pads/Pressure = nan"});
    check_error("subsection Pads\n  set Pressure =\nend\n", {}, {"FILE:2", "Pads/Pressure"});
    check_error("subsection Discretization\n  set Degree = 2.5\nend\n", {},
                {"FILE:2", "Discretization/Degree"});
    check_error("subsection Discretization\n  set Degree = 0\nend\n", {},
                {"FILE:2", "Discretization/Degree"});
    check_error("subsection Discretization\n  set Rotor cells = 5, 36\nend\n", {},
                {"FILE:2", "Discretization/Rotor cells = 5, 36"});
    check_error("", {"Eigenproblem/Solver=magic"},
                {"--set", "Eigenproblem/Solver = magic", "block_krylov", "krylov", "dense"});
  }

  TEST_CASE("parameter_file: malformed lines name their line")
  {
    check_error("set Stage full\n", {}, {"FILE:1", "set Key = value"});
    check_error("\n\nStage = full\n", {}, {"FILE:3", "subsection", "Stage = full"});
    check_error("end\n", {}, {"FILE:1", "closes no subsection"});
    check_error("subsection Rotor\n", {}, {"FILE", "'Rotor'", "no 'end'"});
    check_error("", {"Stage"}, {"--set \"Stage\"", "Section/Key=value"});
    CHECK(contains(message_of<InputError>([]() { ParameterFile().read("/nowhere/brake.prm", {}); }),
                   "/nowhere/brake.prm"));
  }

  // A stream of a directory is empty: it must not be read as all parameters at their defaults.
  TEST_CASE("parameter_file: a directory is no parameter file")
  {
    const std::string message = message_of<InputError>([]() { ParameterFile().read("/tmp", {}); });
    CHECK(contains(message, "/tmp"));
  }

  TEST_CASE("parameter_file: rules across keys")
  {
    // Radii in order.
    check_error("", {"Rotor/Inner radius=0.15"},
                {"FILE", "Rotor/Inner radius = 0.15", "Rotor/Outer radius"});
    check_error("", {"Pads/Inner radius=0.14"}, {"Pads/Inner radius = 0.14", "Pads/Outer radius"});
    // The pads lie on the rotor; without pads their radii do not matter.
    check_error("", {"Pads/Outer radius=0.16"}, {"Pads/Outer radius = 0.16", "0.15"});
    check_error("", {"Pads/Inner radius=0.04"}, {"Pads/Inner radius = 0.04", "0.05"});
    CHECK(error_of("", {"Pads/Outer radius=0.16", "Pads/Arrangement=none"}) == "");
    CHECK(error_of("", {"Pads/Outer radius=0.15", "Pads/Inner radius=0.05"}) == "");
    // Poisson's ratio in (-1, 0.5).
    for (const std::string body : {"Rotor", "Pads"})
    {
      const std::string key = body + "/Material/Poisson ratio";
      check_error("", {key + "=0.5"}, {key + " = 0.5"});
      check_error("", {key + "=-1"}, {key + " = -1"});
      CHECK(error_of("", {key + "=0.499"}) == "");
    }
    // The friction damping has no value at rest.
    check_error("", {"Operation/Angular velocity=0"},
                {"Operation/Angular velocity = 0", "friction_damping"});
    CHECK(error_of("", {"Operation/Angular velocity=0", "Stage=friction"}) == "");
    CHECK(error_of("", {"Operation/Angular velocity=0", "Pads/Arrangement=none"}) == "");
    // A ring needs three cells.
    check_error("", {"Discretization/Rotor cells=1, 2, 1"}, {"Discretization/Rotor cells", "3"});
    // The scene of matrices needs two of them.
    check_error("", {"Scene=matrices"}, {"Matrices/Mass"});
    check_error("", {"Scene=matrices", "Matrices/Mass=m.mtx"}, {"Matrices/Stiffness"});
    CHECK(error_of("", {"Scene=matrices", "Matrices/Mass=m.mtx", "Matrices/Stiffness=k.mtx"}) ==
          "");
  }

  TEST_CASE(
      "parameter_file: the parameters used reproduce themselves, the text is kept byte for byte")
  {
    const std::string text =
        "subsection Rotor # odd  blanks\r\n set   Thickness=0.0123456789012345\nend";
    const auto file =
        read(text, {"Contact/Friction/Coefficient=0.1", "Discretization/Pad cells=1,2,3"});
    CHECK(file->original_text() == text);

    std::ostringstream used;
    file->print_used(used);
    const auto again = read(used.str());
    CHECK(again->parameters().rotor.thickness == 0.0123456789012345);
    CHECK(again->parameters().contact.friction.coefficient == 0.1);
    CHECK(again->parameters().discretization.pad_cells == std::array<unsigned int, 3>{{1, 2, 3}});
    std::ostringstream used_again;
    again->print_used(used_again);
    CHECK(used_again.str() == used.str());
  }

  TEST_CASE("parameter_file: the manual has every key in every format")
  {
    const ParameterFile file;
    for (const std::string format : {"prm", "json", "md"})
    {
      CAPTURE(format);
      std::ostringstream manual;
      file.print_manual(manual, format);
      for (const std::string word :
           {"Thickness", "Coefficient at speed", "friction_damping", "1.25e+11"})
      {
        CAPTURE(word);
        CHECK(contains(manual.str(), word));
      }
    }
    std::ostringstream manual;
    CHECK_THROWS_AS(file.print_manual(manual, "xml"), InputError);
  }

  TEST_CASE("parameters: the ladder of stages")
  {
    // theory.md, section 5: each stage has what the one before has, and one thing more.
    const auto count = [](const Stage stage)
    {
      const StageTerms t = terms_of(stage);
      return t.transport + 2 * t.friction + 4 * t.friction_damping + 8 * t.material_damping;
    };
    CHECK(count(Stage::elastic) == 0);
    CHECK(count(Stage::transport) == 1);
    CHECK(count(Stage::friction) == 3);
    CHECK(count(Stage::friction_damping) == 7);
    CHECK(count(Stage::full) == 15);
  }
} // namespace squeal::tests::parameter_file_tests

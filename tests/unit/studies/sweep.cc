#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/base/log.h>
#include <squeal/studies/sweep.h>
namespace squeal::tests::sweep_tests
{
  namespace
  {
    /// A parameter file with a sweep.
    std::unique_ptr<ParameterFile> sweep_of(const std::string &parameter, const std::string &values,
                                            const double second = 0)
    {
      auto file = std::make_unique<ParameterFile>();
      file->choose("Sweep/Values", values); // first: a sweep without values is refused
      file->choose("Sweep/Parameter", parameter);
      file->choose("Sweep/Critical values", "true");
      file->vary({second_factor}, {second});
      return file;
    }

    EigensolverOptions window(const double max_imaginary)
    {
      EigensolverOptions options;
      options.max_imaginary = max_imaginary;
      return options;
    }

    struct Tables
    {
      std::string sweep, critical;
    };

    Tables run(ParameterFile &file, Model &model, const double max_imaginary,
               const TemporaryDirectory &directory, const ModelFactory &factory = {})
    {
      Log log(MPI_COMM_SELF);
      Sweep(file, model, factory, window(max_imaginary), directory.name, MPI_COMM_WORLD, log).run();
      MPI_Barrier(MPI_COMM_WORLD);
      Tables tables{directory.text_of("sweep.csv"), directory.text_of("critical.csv")};
      MPI_Barrier(MPI_COMM_WORLD); // nobody writes the next tables while another rank reads these
      return tables;
    }

    double value(const std::map<std::string, std::string> &row, const std::string &column)
    {
      return std::stod(row.at(column));
    }

    /// The eigenvalues at a value.
    std::vector<Complex> at(const std::vector<std::map<std::string, std::string>> &rows,
                            const double parameter)
    {
      std::vector<Complex> result;
      for (const auto &row : rows)
        if (std::abs(value(row, "parameter") - parameter) < 1e-12)
          result.emplace_back(value(row, "growth_rate_1_per_s"),
                              2 * M_PI * value(row, "frequency_hz"));
      return result;
    }
  } // namespace

  TEST_CASE("sweep: modes of two chains and where they coalesce")
  {
    // TwoChains without damping: modes 1 and 2 in the window 0.26. Two modes meet at p = d/(2 w^2)
    // with frequency sqrt(w^2 + d/2): for w_2^2 = 0.04089 at 0.2446; for w_1^2 = 0.01026 at 0.975,
    // beyond the sweep.
    const auto model = TwoChains::model();
    const auto file  = sweep_of(first_factor, "0.05 : 0.35 : 4");
    const TemporaryDirectory directory;
    const Tables tables = run(*file, *model, 0.26, directory);
    const auto rows     = read_table(tables.sweep);
    for (const double p : {0.05, 0.15, 0.25, 0.35})
      CHECK(distance_of_sets(at(rows, p), TwoChains::eigenvalues(2, p, 0)) <= 1e-8);
    const auto critical = read_table(tables.critical);
    REQUIRE(critical.size() == 1);
    const double square = chain_square(TwoChains::n, 2);
    CHECK(critical[0].at("kind") == "coalescence");
    CHECK(relative_error(value(critical[0], "value"), TwoChains::d / (2 * square)) <= 1e-7);
    CHECK(relative_error(value(critical[0], "frequency_hz"),
                         std::sqrt(square + TwoChains::d / 2) / (2 * M_PI)) <= 1e-5);
    CHECK(value(critical[0], "accuracy") <= 1e-6);
    // The parameter is what it was, and nothing is left to resume from.
    CHECK(file->value_of(first_factor) == 1);
    CHECK(!std::filesystem::exists(directory.name + "/sweep.state"));
  }

  TEST_CASE("sweep: onset and end of flutter with damping")
  {
    // l = i W is a root of l^2 + c l + s for complex s = w^2 + d/2 +- i b if W^2 = w^2 + d/2 and
    // b = c W: p^2 w^4 = d^2/4 + c^2 (w^2 + d/2). Upwards the mode begins to grow there, downwards
    // it ends.
    const double c = 0.005, square = chain_square(TwoChains::n, 2),
                 mean     = square + TwoChains::d / 2,
                 expected = std::sqrt(TwoChains::d * TwoChains::d / 4 + c * c * mean) / square;
    for (const bool upwards : {true, false})
    {
      CAPTURE(upwards);
      const auto model = TwoChains::model();
      const auto file  = sweep_of(first_factor, upwards ? "0.2 : 0.3 : 3" : "0.3 : 0.2 : 3", c);
      const TemporaryDirectory directory;
      const auto critical   = read_table(run(*file, *model, 0.26, directory).critical);
      unsigned int n_onsets = 0;
      for (const auto &row : critical)
        if (row.at("kind") != "coalescence")
        {
          ++n_onsets;
          CHECK(row.at("kind") == (upwards ? "onset" : "end"));
          CHECK(relative_error(value(row, "value"), expected) <= 1e-8);
          CHECK(relative_error(value(row, "frequency_hz"), std::sqrt(mean) / (2 * M_PI)) <= 1e-7);
          CHECK(std::abs(value(row, "growth_rate_1_per_s")) <= 1e-9);
        }
      CHECK(n_onsets == 1);
    }
  }

  TEST_CASE("sweep: divergence")
  {
    // A chain pressed by -p: w_j^2 = 4 sin^2(j pi/82) - p passes zero at p = w_1^2 = 0.005868, as a
    // non-conservative load, which the inertia count does not see.
    ChainModel model(40);
    model.add(Origin::inertia, 2, diagonal(40, 1))
        .add(Origin::elasticity, 0, chain(40))
        .add(Origin::friction, 0, diagonal(40, -1), ChainModel::first);
    const auto file = sweep_of(first_factor, "0 : 0.008 : 3");
    const TemporaryDirectory directory;
    const auto critical = read_table(run(*file, model, 0.25, directory).critical);
    REQUIRE(critical.size() == 1);
    CHECK(critical[0].at("kind") == "divergence");
    CHECK(relative_error(value(critical[0], "value"), chain_square(40, 1)) <= 1e-9);
  }

  TEST_CASE("sweep: one that was killed goes on with the same tables")
  {
    // Killed after a number of assemblies: those before the kill are there, the others follow.
    const TemporaryDirectory whole_directory;
    const auto whole_model = TwoChains::model();
    const Tables whole =
        run(*sweep_of(first_factor, "0.05 : 0.35 : 7"), *whole_model, 0.26, whole_directory);
    if (dealii::Utilities::MPI::this_mpi_process(MPI_COMM_WORLD) == 0)
      std::filesystem::remove(whole_directory.name + "/sweep.csv");
    MPI_Barrier(MPI_COMM_WORLD);
    const TemporaryDirectory &directory = whole_directory;
    const auto model                    = TwoChains::model();
    model->most_assemblies              = 4;
    CHECK(contains(
        message_of<SolverError>(
            [&]() { run(*sweep_of(first_factor, "0.05 : 0.35 : 7"), *model, 0.26, directory); }),
        "killed"));
    CHECK(std::filesystem::exists(directory.name + "/sweep.state"));
    model->most_assemblies = -1;
    const Tables resumed = run(*sweep_of(first_factor, "0.05 : 0.35 : 7"), *model, 0.26, directory);
    CHECK(same_tables(resumed.sweep, whole.sweep));
    CHECK(same_tables(resumed.critical, whole.critical));
  }

  TEST_CASE("sweep: a parameter that changes the mesh")
  {
    // Each value of Strip/Length has a chain of its own: stiffness s K on 40 masses for s < 0.5, on
    // 41 beyond. With 40 masses the vectors tell the branches, else the eigenvalues.
    const auto make = [](const Parameters::All &parameters) -> std::unique_ptr<Model>
    {
      const double s       = parameters.strip.length;
      const unsigned int n = s < 0.5 ? 40 : 41;
      auto model           = std::make_unique<ChainModel>(n);
      model->add(Origin::inertia, 2, diagonal(n, 1)).add(Origin::elasticity, 0, chain(n, s));
      return model;
    };
    const auto file = sweep_of("Strip/Length", "0.45 : 0.51 : 3");
    const TemporaryDirectory directory;
    const auto first = make(file->parameters());
    const auto rows  = read_table(run(*file, *first, 0.2, directory, make).sweep);
    for (const double s : {0.45, 0.48, 0.51})
    {
      CAPTURE(s);
      const unsigned int n = s < 0.5 ? 40 : 41;
      std::vector<Complex> expected;
      for (unsigned int j = 1; std::sqrt(s * chain_square(n, j)) < 0.2; ++j)
        expected.emplace_back(0, std::sqrt(s * chain_square(n, j)));
      CHECK(distance_of_sets(at(rows, s), expected) <= 1e-8);
      for (const auto &row : rows)
        if (std::abs(value(row, "parameter") - s) < 1e-12)
        {
          CHECK(value(row, "branch") == value(row, "mode"));
          CHECK(row.at("overlap").empty() == (s != 0.48));
        }
    }
  }

  TEST_CASE("sweep: parameters that nothing depends on are refused")
  {
    const auto model = TwoChains::model();
    const auto file  = sweep_of("Eigenproblem/Tolerance", "1e-9, 1e-8");
    Log log(MPI_COMM_SELF);
    CHECK(contains(message_of<InputError>(
                       [&]() { Sweep(*file, *model, {}, window(0.26), "", MPI_COMM_WORLD, log); }),
                   "do not depend on it"));
  }
} // namespace squeal::tests::sweep_tests

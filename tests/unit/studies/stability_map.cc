#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/base/log.h>
#include <squeal/studies/stability_map.h>
namespace squeal::tests::stability_map_tests
{
  namespace
  {
    std::unique_ptr<ParameterFile> map_over(const std::string &values,
                                            const std::string &second_values,
                                            const std::string &parameter = first_factor)
    {
      auto file = std::make_unique<ParameterFile>();
      file->choose("Sweep/Values", values); // first: a parameter without values is refused
      file->choose("Sweep/Parameter", parameter);
      file->choose("Sweep/Second values", second_values);
      file->choose("Sweep/Second parameter", second_factor);
      return file;
    }

    struct Tables
    {
      std::string map, border;
    };

    Tables run(ParameterFile &file, Model &model, const double max_imaginary,
               const TemporaryDirectory &directory)
    {
      EigensolverOptions options;
      options.max_imaginary = max_imaginary;
      Log log(MPI_COMM_SELF);
      StabilityMap(file, model, options, directory.name, MPI_COMM_WORLD, log).run();
      MPI_Barrier(MPI_COMM_WORLD);
      Tables tables{directory.text_of("map.csv"), directory.text_of("border.csv")};
      MPI_Barrier(MPI_COMM_WORLD); // nobody writes the next tables while another rank reads these
      return tables;
    }

    double value(const std::map<std::string, std::string> &row, const std::string &column)
    {
      return std::stod(row.at(column));
    }
  } // namespace

  TEST_CASE("stability map: the boundary of flutter of two chains" *
            doctest::test_suite("one rank"))
  {
    // TwoChains: the pair of mode 2 flutters for p^2 w^4 > d^2/4 + c^2 (w^2 + d/2), on the boundary
    // with frequency sqrt(w^2 + d/2); the pair of mode 1 does so beyond p = 0.975 only.
    const auto model = TwoChains::model();
    const auto file  = map_over("0.2 : 0.4 : 3", "0.002 : 0.01 : 3");
    const TemporaryDirectory directory;
    const Tables tables = run(*file, *model, 0.26, directory);
    const double square = chain_square(TwoChains::n, 2), mean = square + TwoChains::d / 2;
    const auto critical = [&](const double c)
    { return std::sqrt(TwoChains::d * TwoChains::d / 4 + c * c * mean) / square; };
    const auto points = read_table(tables.map);
    CHECK(points.size() == 9);
    for (const auto &point : points)
    {
      const bool unstable = value(point, first_factor) > critical(value(point, second_factor));
      CHECK(value(point, "unstable_modes") == (unstable ? 1 : 0));
      CHECK(point.at("verdict") == (unstable ? "flutter" : "stable"));
    }
    const auto border = read_table(tables.border);
    CHECK(border.size() >= 4);
    double lowest = HUGE_VAL, highest = 0;
    for (const auto &point : border)
    {
      const double c = value(point, second_factor);
      CHECK(point.at("curve") == "0");
      CHECK(point.at("kind") == "flutter");
      CHECK(relative_error(value(point, first_factor), critical(c)) <= 1e-7);
      CHECK(relative_error(value(point, "frequency_hz"), std::sqrt(mean) / (2 * M_PI)) <= 1e-6);
      lowest  = std::min(lowest, c);
      highest = std::max(highest, c);
    }
    // It leaves the map through both ends of the second parameter.
    CHECK(relative_error(lowest, 0.002) <= 1e-9);
    CHECK(relative_error(highest, 0.01) <= 1e-9);
    CHECK(!std::filesystem::exists(directory.name + "/map.state"));
  }

  namespace
  {
    /// A chain pressed by -p and stiffened by c K: w_j^2 = (1 + c) 4 sin^2(j pi/82) - p.
    std::unique_ptr<ChainModel> pressed_chain()
    {
      auto model = std::make_unique<ChainModel>(40);
      model->add(Origin::inertia, 2, diagonal(40, 1))
          .add(Origin::elasticity, 0, chain(40))
          .add(Origin::friction, 0, diagonal(40, -1), ChainModel::first)
          .add(Origin::friction, 0, chain(40), ChainModel::second);
      return model;
    }
  } // namespace

  TEST_CASE("stability map: the boundary of divergence is a straight line" *
            doctest::test_suite("one rank"))
  {
    // det Q = 0 at p = (1 + c) w_1^2, w_1^2 = 4 sin^2(pi/82) = 0.0058666.
    const auto file = map_over("0.002 : 0.01 : 3", "0 : 0.2 : 3");
    const TemporaryDirectory directory;
    const auto border = read_table(run(*file, *pressed_chain(), 0.25, directory).border);
    CHECK(border.size() >= 4);
    for (const auto &point : border)
    {
      CHECK(point.at("kind") == "divergence");
      CHECK(relative_error(value(point, first_factor),
                           (1 + value(point, second_factor)) * chain_square(40, 1)) <= 1e-7);
    }
  }

  TEST_CASE("stability map: one that was killed goes on with the same tables" *
            doctest::test_suite("one rank"))
  {
    const TemporaryDirectory directory;
    const Tables whole =
        run(*map_over("0.2 : 0.4 : 3", "0.002 : 0.01 : 3"), *TwoChains::model(), 0.26, directory);
    for (const int most : {5, 20})
    {
      CAPTURE(most);
      const auto model       = TwoChains::model();
      model->most_assemblies = most;
      const auto again       = [&]()
      { return run(*map_over("0.2 : 0.4 : 3", "0.002 : 0.01 : 3"), *model, 0.26, directory); };
      const std::string message = message_of<SolverError>([&]() { again(); });
      CHECK(contains(message, "killed"));
      CHECK(std::filesystem::exists(directory.name + "/map.state"));
      model->most_assemblies = -1;
      const Tables resumed   = again();
      CHECK(same_tables(resumed.map, whole.map));
      CHECK(same_tables(resumed.border, whole.border));
    }
  }

  TEST_CASE("stability map: parameters that change the mesh are refused" *
            doctest::test_suite("one rank"))
  {
    const auto model = TwoChains::model();
    const auto file  = map_over("0.1, 0.2", "0, 1", "Strip/Length");
    Log log(MPI_COMM_SELF);
    CHECK(contains(
        message_of<InputError>([&]() { StabilityMap(*file, *model, {}, "", MPI_COMM_WORLD, log); }),
        "keeps the mesh"));
  }
} // namespace squeal::tests::stability_map_tests

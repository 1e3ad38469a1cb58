#include <squeal/base/names.h>
#include <squeal/parameters/choices.h>
#include <squeal/run/advice.h>

#include <doctest/doctest.h>
namespace squeal::tests::names_tests
{
  namespace
  {
    SQUEAL_CHOICE(Colour, red, dark_green, blue)
  } // namespace

  TEST_CASE("names: a choice and its names are one list")
  {
    CHECK(names_of(Colour()).size() == 3);
    CHECK(name_of(Colour::dark_green) == "dark_green");
    CHECK(value_named<Colour>("blue") == Colour::blue);
    CHECK(all_names<Colour>("|") == "red|dark_green|blue");
    // auto is no name in C++: the table is written by hand.
    CHECK(value_named<LinearSolver>("auto") == LinearSolver::automatic);
  }

  TEST_CASE("names: an unknown name is refused with those that are known")
  {
    std::string message;
    try
    {
      value_named<Colour>("yellow");
    }
    catch (const InputError &error)
    {
      message = error.what();
    }
    CHECK(message == "yellow: allowed are red, dark_green, blue.");
  }

  TEST_CASE("advice: every failure has one, and several follow each other")
  {
    for (int kind = 0; kind <= int(Failure::iterative_statics_failed); ++kind)
      CHECK(!advice(SolverError("", {Failure(kind)})).empty());
    CHECK(advice(SolverError("")).empty());
    const std::string stalled = advice(SolverError("", {Failure::gmres_stalled})),
                      failed  = advice(SolverError("", {Failure::iterative_statics_failed}));
    CHECK(advice(SolverError("", {Failure::gmres_stalled, Failure::iterative_statics_failed})) ==
          stalled + failed);
  }
} // namespace squeal::tests::names_tests

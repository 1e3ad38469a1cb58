#pragma once

#include "helpers.h"

#include <squeal/model/model.h>
#include <squeal/parameters/parameter_file.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>

/// Chains of masses as models whose terms depend on two parameters, and what their sweeps write.
namespace squeal::tests
{
  using Complex = std::complex<double>;

  inline const std::string first_factor  = "Matrices/Circulatory factor",
                           second_factor = "Matrices/Velocity factor";

  /// omega_j^2 of a chain of n unit masses between unit springs with fixed ends, j = 1 ... n.
  inline double chain_square(const unsigned int n, const unsigned int j)
  {
    return 4 * std::pow(std::sin(j * M_PI / (2 * (n + 1))), 2);
  }

  /// Factor times second differences, the stiffness of such a chain, from row and column on.
  inline std::vector<Entry> chain(const unsigned int n, const double factor = 1,
                                  const unsigned int row = 0, const unsigned int column = 0)
  {
    std::vector<Entry> entries;
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = i == 0 ? 0 : i - 1; j < std::min(n, i + 2); ++j)
        entries.push_back({row + i, column + j, i == j ? 2 * factor : -factor});
    return entries;
  }

  /// Constant terms and terms with the factors Matrices/Circulatory factor and Matrices/Velocity
  /// factor.
  class ChainModel : public Model
  {
  public:
    enum Factor
    {
      constant,
      first,
      second
    };

    explicit ChainModel(const unsigned int n) : rows(even_rows(n)) {}

    ChainModel &add(const Origin origin, const unsigned int order,
                    const std::vector<Entry> &entries, const Factor factor = constant)
    {
      parts.push_back(
          {{origin, order, 1, std::make_shared<const Matrix>(matrix_of(rows, entries))}, factor});
      return *this;
    }

    void assemble(const Parameters::All &parameters, const LinearOperator & = {}) override
    {
      if (most_assemblies-- == 0)
        throw SolverError("killed");
      factors = {{1, parameters.matrices.circulatory_factor, parameters.matrices.velocity_factor}};
      equations_                  = {};
      equations_.rows             = rows;
      equations_.reference_name   = "the conservative chain";
      equations_.may_move_rigidly = false;
      for (const Part &part : parts)
      {
        equations_.terms.push_back(part.term);
        equations_.terms.back().coefficient = factors[part.factor];
      }
    }

    std::vector<ParameterDerivative> derivatives(const std::string &only,
                                                 const LinearOperator & = {}) const override
    {
      std::vector<ParameterDerivative> all = {{first_factor, factors[first], {}},
                                              {second_factor, factors[second], {}}};
      for (const Part &part : parts)
        if (part.factor != constant)
          all[part.factor - first].terms.push_back(part.term);
      all.erase(std::remove_if(all.begin(), all.end(),
                               [&](const ParameterDerivative &d)
                               { return !only.empty() && d.parameter != only; }),
                all.end());
      return all;
    }

    std::pair<std::vector<std::string>, std::vector<unsigned int>> bodies_of_rows() const override
    {
      return {{"chain"}, std::vector<unsigned int>(rows.n_local(), 0)};
    }

    Sectors sectors() const override
    {
      return symmetry;
    }

    const RowRange rows;
    std::optional<MirrorSymmetry> symmetry;
    int most_assemblies = -1; ///< the next one fails

  private:
    struct Part
    {
      Term term;
      Factor factor;
    };
    std::vector<Part> parts;
    std::array<double, 3> factors = {{1, 1, 1}};
  };

  /// Two chains of n masses, the second on a bed of springs d, with circulatory forces p K between
  /// them and damping c:
  ///     q_1'' + c q_1' + K q_1 + p K q_2 = 0,   q_2'' + c q_2' + (K + d) q_2 - p K q_1 = 0.
  /// With the chains' common modes, K v = w^2 v, the eigenvalues are the roots of
  ///     l^2 + c l + s = 0,   s = w^2 + d/2 +- sqrt(d^2/4 - p^2 w^4).
  struct TwoChains
  {
    static constexpr unsigned int n = 30;
    static constexpr double d       = 0.02;

    static std::unique_ptr<ChainModel> model()
    {
      auto result = std::make_unique<ChainModel>(2 * n);
      result->add(Origin::inertia, 2, diagonal(2 * n, 1))
          .add(Origin::elasticity, 0, chain(n) + chain(n, 1, n, n) + diagonal(n, d, n))
          .add(Origin::friction, 0, chain(n, 1, 0, n) + chain(n, -1, n, 0), ChainModel::first)
          .add(Origin::velocity, 1, diagonal(2 * n, 1), ChainModel::second);
      return result;
    }

    /// The eigenvalues with Im l > 0 of the chains' modes up to the j-th.
    static std::vector<Complex> eigenvalues(const unsigned int n_modes, const double p,
                                            const double c)
    {
      std::vector<Complex> result;
      for (unsigned int j = 1; j <= n_modes; ++j)
        for (const double sign : {1., -1.})
        {
          const double square = chain_square(n, j);
          const Complex s =
              square + d / 2 + sign * std::sqrt(Complex(d * d / 4 - p * p * square * square));
          const Complex root = std::sqrt(c * c / 4 - s), l = -c / 2 + root;
          result.push_back(l.imag() > 0 ? l : -c / 2 - root);
        }
      return result;
    }
  };

  /// The largest relative distance of expected eigenvalues from the computed ones, each taken once;
  /// infinite if their numbers differ.
  inline double distance_of_sets(std::vector<Complex> computed,
                                 const std::vector<Complex> &expected)
  {
    if (computed.size() != expected.size())
      return HUGE_VAL;
    double worst = 0;
    for (const Complex &l : expected)
    {
      const auto nearest = std::min_element(computed.begin(), computed.end(),
                                            [&](const Complex &a, const Complex &b)
                                            { return std::abs(a - l) < std::abs(b - l); });
      worst              = std::max(worst, std::abs(*nearest - l) / std::abs(l));
      computed.erase(nearest);
    }
    return worst;
  }

  /// A directory of all ranks that disappears.
  struct TemporaryDirectory
  {
    TemporaryDirectory()
    {
      int number = getpid();
      MPI_Bcast(&number, 1, MPI_INT, 0, MPI_COMM_WORLD);
      name = (std::filesystem::temp_directory_path() / ("squeal-test-" + std::to_string(number)))
                 .string();
      std::filesystem::create_directories(name);
      MPI_Barrier(MPI_COMM_WORLD);
    }
    ~TemporaryDirectory()
    {
      MPI_Barrier(MPI_COMM_WORLD);
      std::error_code ignored;
      std::filesystem::remove_all(name, ignored);
    }
    std::string text_of(const std::string &file) const
    {
      std::ifstream in(name + "/" + file);
      std::ostringstream text;
      text << in.rdbuf();
      return text.str();
    }
    std::string name;
  };

  /// The lines of a table, fields by the names of their columns.
  inline std::vector<std::map<std::string, std::string>> read_table(const std::string &text)
  {
    const auto fields_of = [](const std::string &line)
    {
      std::vector<std::string> fields;
      std::istringstream in(line + ",");
      for (std::string field; std::getline(in, field, ',');)
        fields.push_back(field);
      return fields;
    };
    std::istringstream in(text);
    std::string line;
    std::getline(in, line);
    const std::vector<std::string> header = fields_of(line);
    std::vector<std::map<std::string, std::string>> rows;
    while (std::getline(in, line))
    {
      const std::vector<std::string> fields = fields_of(line);
      rows.emplace_back();
      for (unsigned int k = 0; k < std::min(header.size(), fields.size()); ++k)
        rows.back()[header[k]] = fields[k];
    }
    return rows;
  }

  /// Whether two tables agree: to the last digit on one rank; on several, whose sums come in
  /// changing orders, in their number of lines.
  inline bool same_tables(const std::string &a, const std::string &b)
  {
    return n_ranks() == 1 ? a == b : read_table(a).size() == read_table(b).size();
  }
} // namespace squeal::tests

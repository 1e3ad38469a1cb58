#include <squeal/base/text.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/factorization.h>
#include <squeal/linalg/matrix_market.h>
#include <squeal/model/matrix_model.h>
#include <squeal/model/measured_damping.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  namespace
  {
    RowRange even_rows(const unsigned int n, const MPI_Comm comm)
    {
      int rank = 0, n_ranks = 1;
      MPI_Comm_rank(comm, &rank);
      MPI_Comm_size(comm, &n_ranks);
      RowRange rows;
      rows.comm  = comm;
      rows.begin = static_cast<std::uint64_t>(n) * rank / n_ranks;
      rows.end   = static_cast<std::uint64_t>(n) * (rank + 1) / n_ranks;
      rows.size  = n;
      return rows;
    }

    /// |A - A^T| / |A|, maximum norms of rows.
    double asymmetry_of(const Matrix &matrix, const RowRange &rows)
    {
      Mat transpose = nullptr;
      SQUEAL_PETSC(MatTranspose(matrix, MAT_INITIAL_MATRIX, &transpose));
      const Matrix owner(transpose);
      const double size = matrix.infinity_norm();
      return size > 0 ? sum_of(rows, {{1., matrix}, {-1., owner}}).infinity_norm() / size : 0;
    }
    constexpr double symmetric = 1e-10; ///< an asymmetry that is none

    void check_symmetric(const Matrix &mass, const RowRange &rows, const std::string &filename)
    {
      if (asymmetry_of(mass, rows) > symmetric)
        throw InputError("Matrices/Mass = " + filename + ": the mass matrix must be symmetric.");
    }

    /// Negative eigenvalues of A's symmetric part beyond rounding: of A + r diag |A| with what
    /// texts of nine digits leave of a zero, by inertia.
    int n_negative_beyond_rounding(const Matrix &matrix, const RowRange &rows,
                                   const std::string &name)
    {
      constexpr double rounding = 1e-8, nothing = 1e-14;
      const Matrix part     = symmetric_part(rows, matrix);
      const double smallest = nothing * matrix.infinity_norm();
      if (!part || smallest == 0)
        return 0;
      EntryList entries;
      for (unsigned int row = rows.begin; row < rows.end; ++row)
        entries.add(row, row, smallest);
      for_entries(part,
                  [&](const PetscInt row, const PetscInt column, const double value) {
                    entries.add(row, column,
                                row == column ? value + rounding * std::abs(value) : value);
                  });
      return Factorization(entries.make_matrix(rows), Factorization::Kind::ldlt,
                           name + " (for its definiteness)")
          .inertia()
          .negative;
    }

    void check_semidefinite(const Matrix &mass, const RowRange &rows, const std::string &filename)
    {
      if (const int n = n_negative_beyond_rounding(mass, rows, "the mass matrix"); n > 0)
        throw InputError("Matrices/Mass = " + filename + ": the mass matrix is indefinite, " +
                         std::to_string(n) +
                         " of its eigenvalues are negative beyond rounding: there are motions with "
                         "a negative kinetic energy. It must be positive semi-definite.");
    }

    /// What is unusual about a stiffness, which may be anything: a structure's is symmetric and
    /// positive semi-definite.
    void add_doubts(const Matrix &stiffness, const RowRange &rows, const std::string &setting,
                    std::vector<std::string> &all)
    {
      if (const double asymmetry = asymmetry_of(stiffness, rows); asymmetry > symmetric)
        all.push_back(text_of("Warning, stiffness: ", setting, " is not symmetric (by ",
                              number(asymmetry, 2),
                              " of its size): it has circulatory forces, which may excite, ",
                              asymmetry < 1e-6 ? "if only by rounding; make it symmetric."
                                               : "as Matrices/Circulatory has them."));
      if (const int n = n_negative_beyond_rounding(stiffness, rows, "the stiffness"); n > 0)
        all.push_back(text_of("Warning, stiffness: ", setting, " has ", n,
                              n == 1 ? " negative eigenvalue" : " negative eigenvalues",
                              " beyond rounding (of its symmetric part): motions that diverge "
                              "unless other forces hold them, as no structure has them."));
    }
  } // namespace

  MatrixModel::MatrixModel(const Parameters::Matrices &names, const MPI_Comm comm)
  {
    const auto file = read_matrix_market(names.mass, "Matrices/Mass");
    if (file.n_rows != file.n_columns)
      throw InputError("Matrices/Mass = " + names.mass + ": the matrix has " +
                       std::to_string(file.n_rows) + " rows and " + std::to_string(file.n_columns) +
                       " columns; it must be square.");
    // Memory is taken by rows; a matrix without mass in most of them is none of a model.
    constexpr std::size_t few = 1000000, rows_per_entry = 100;
    if (file.n_rows > few && file.n_rows / rows_per_entry > file.values.size())
      throw InputError("Matrices/Mass = " + names.mass + ": the matrix has " +
                       std::to_string(file.n_rows) + " rows, but only " +
                       std::to_string(file.values.size()) + " entries.");
    int n_ranks = 1;
    MPI_Comm_size(comm, &n_ranks);
    if (n_ranks > int(file.n_rows))
      throw InputError("Matrices/Mass = " + names.mass + ": the matrix has fewer rows (" +
                       std::to_string(file.n_rows) + ") than there are ranks (" +
                       std::to_string(n_ranks) + "). Use fewer ranks.");
    rows = even_rows(file.n_rows, comm);
    mass = std::make_shared<const Matrix>(distribute(file, rows));
    check_symmetric(*mass, rows, names.mass);
    check_semidefinite(*mass, rows, names.mass);

    const auto read = [&](const std::string &filename,
                          const std::string &key) -> std::shared_ptr<const Matrix>
    {
      if (filename.empty())
        return nullptr;
      const auto matrix = read_matrix_market(filename, key);
      if (matrix.n_rows != file.n_rows || matrix.n_columns != file.n_rows)
        throw InputError(key + " = " + filename + ": the matrix is " +
                         std::to_string(matrix.n_rows) + " x " + std::to_string(matrix.n_columns) +
                         ", the mass matrix " + std::to_string(file.n_rows) + " x " +
                         std::to_string(file.n_rows) + ": all matrices must have one size.");
      return std::make_shared<const Matrix>(distribute(matrix, rows));
    };
    velocity    = read(names.velocity, "Matrices/Velocity");
    stiffness   = read(names.stiffness, "Matrices/Stiffness");
    circulatory = read(names.circulatory, "Matrices/Circulatory");
    add_doubts(*stiffness, rows, "Matrices/Stiffness = " + names.stiffness, doubts_);
    for (unsigned int k = 0; k < names.viscoelastic.size(); ++k)
    {
      const std::string key = "Matrices/Viscoelastic " + std::to_string(k + 1) + "/Stiffness",
                        &file_name = names.viscoelastic[k].stiffness;
      viscoelastic.push_back(read(file_name, key));
      if (viscoelastic.back())
        add_doubts(*viscoelastic.back(), rows, key + " = " + file_name, doubts_);
    }
  }

  void MatrixModel::assemble(const Parameters::All &parameters, const LinearOperator &)
  {
    circulatory_factor            = parameters.matrices.circulatory_factor;
    velocity_factor               = parameters.matrices.velocity_factor;
    equations_                    = {};
    equations_.rows               = rows;
    equations_.matrices_are_given = true;
    equations_.reference          = EquationsOfMotion::Reference::symmetric_part;
    equations_.reference_name =
        "the symmetric part of the position matrix, without velocity terms,";
    std::vector<Term> &terms                = equations_.terms;
    std::vector<RelaxationTerm> &relaxation = equations_.relaxation;

    terms = {{Origin::inertia, 2, 1., mass},
             {Origin::velocity, 1, velocity_factor, velocity},
             {Origin::elasticity, 0, 1., stiffness},
             {Origin::friction, 0, circulatory_factor, circulatory}};
    for (unsigned int k = 0; k < viscoelastic.size(); ++k)
    {
      const auto &[file, factor, stiffness_factor] = parameters.matrices.viscoelastic[k];
      if (!viscoelastic[k])
        continue;
      terms.push_back({Origin::elasticity, 0, factor, viscoelastic[k]});
      if (stiffness_factor.is_active())
        relaxation.push_back({Origin::material_damping, factor, viscoelastic[k], stiffness_factor});
    }
    terms.erase(
        std::remove_if(terms.begin(), terms.end(), [](const Term &term) { return !term.matrix; }),
        terms.end());
    damping_factor = parameters.modal_damping.factor;
    if (parameters.modal_damping.is_active())
      relaxation.push_back(measured_damping(equations_, sectors(), parameters));
  }

  std::vector<ParameterDerivative> MatrixModel::derivatives(const std::string &only,
                                                            const LinearOperator &) const
  {
    std::vector<ParameterDerivative> all;
    if (circulatory)
      all.push_back({"Matrices/Circulatory factor",
                     circulatory_factor,
                     {{Origin::friction, 0, 1., circulatory}}});
    if (velocity)
      all.push_back(
          {"Matrices/Velocity factor", velocity_factor, {{Origin::velocity, 1, 1., velocity}}});
    for (const RelaxationTerm &term : relaxation())
    {
      if (term.low_rank)
      {
        all.push_back(derivative_by_factor(term, damping_factor));
        continue;
      }
      const auto section =
          "Matrices/Viscoelastic " +
          std::to_string(1 + (std::find(viscoelastic.begin(), viscoelastic.end(), term.matrix) -
                              viscoelastic.begin())) +
          "/";
      all.push_back({section + "Factor",
                     term.coefficient,
                     {{Origin::elasticity, 0, 1., term.matrix}},
                     {{1., term.matrix, [factor = term.factor](const std::complex<double> l) {
                         return factor(l) - 1.;
                       }}}});
      for (const StiffnessFactor::Constant &constant : term.factor.constants())
        all.push_back({section + constant.name,
                       constant.value,
                       {},
                       {{term.coefficient, term.matrix, constant.derivative}}});
    }
    all.erase(std::remove_if(all.begin(), all.end(),
                             [&](const ParameterDerivative &d)
                             { return !only.empty() && d.parameter != only; }),
              all.end());
    return all;
  }
} // namespace squeal

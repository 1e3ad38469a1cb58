#include <squeal/bodies/displacement_multigrid.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/linalg/petsc_vector_view.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/statics/iterative_statics.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// y = A x for one column; multiply() is made for many.
    MultiVector multiply_column(const Matrix &matrix, const MultiVector &x)
    {
      MultiVector y(x.row_range(), 1);
      if (!matrix)
        return y;
      SQUEAL_PETSC(MatMult(matrix, PetscVectorView(x), PetscVectorView(y.row_range(), y.data())));
      return y;
    }
  } // namespace

  template <int dim>
  struct IterativeStatics<dim>::Bodies
  {
    const DisplacementOperator<dim> stiffness;
    DisplacementMultigrid<dim> multigrid;

    Bodies(const FiniteElementSpace<dim> &spaces, const std::vector<MaterialOperator> &bodies,
           const Multigrid algebraic)
        : stiffness(spaces, bodies), multigrid(spaces, bodies, stiffness, algebraic)
    {
    }

    /// With the stiffness and the matrices of contact.
    MultiVector multiply(const Matrix &normal, const Matrix &friction, const MultiVector &x) const
    {
      MultiVector y = stiffness.multiply(x);
      y += multiply_column(normal, x);
      y += multiply_column(friction, x);
      return y;
    }
  };

  template <int dim>
  struct IterativeStatics<dim>::Preconditioner
  {
    Preconditioner(const FiniteElementSpace<dim> &spaces, Bodies &bodies,
                   const Contact<dim> &contact, const ContactPressure &pressure,
                   bool with_friction);

    MultiVector apply(const MultiVector &residual) const;

    Bodies &bodies;
    const bool mortar;
    const unsigned int n_displacements; ///< of this rank
    const Matrix normal, friction;
    Matrix of_displacements;    ///< N D N^T; mortar only
    std::vector<double> D;      ///< by row of this rank; zero but for active multipliers
    std::vector<double> soft;   ///< 1 - D C with the lumped C
    std::vector<double> closed; ///< 1/d of rows d L = 0 of released multipliers, else zero

  private:
    void set_weights(const Contact<dim> &contact, const RowRange &rows);
  };

  template <int dim>
  IterativeStatics<dim>::Preconditioner::Preconditioner(const FiniteElementSpace<dim> &spaces,
                                                        Bodies &bodies, const Contact<dim> &contact,
                                                        const ContactPressure &pressure,
                                                        const bool with_friction)
      : bodies(bodies), mortar(contact.contact_model().mortar),
        n_displacements(spaces.first_local_multiplier - spaces.rows.begin),
        normal(normal_matrix(contact)),
        friction(with_friction ? friction_matrix(contact, pressure) : Matrix())
  {
    if (!mortar)
    {
      bodies.multigrid.set_up(normal);
      return;
    }
    set_weights(contact, spaces.rows);
    // [C N^T; N 0] [D 0; 0 0] [C N^T; N 0] holds N D N^T in the rows of displacements.
    Mat weighted = nullptr, product = nullptr;
    SQUEAL_PETSC(MatDuplicate(normal, MAT_COPY_VALUES, &weighted));
    const Matrix of_multipliers(weighted);
    MultiVector weights(spaces.rows, 1);
    std::copy(D.begin(), D.end(), weights.data());
    SQUEAL_PETSC(MatDiagonalScale(weighted, PetscVectorView(weights), nullptr));
    SQUEAL_PETSC(MatMatMult(normal, weighted, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    of_displacements = Matrix(product);
    bodies.multigrid.set_up(of_displacements);
  }

  /// D^{-1} = diag(N^T diag(A)^{-1} N) + C, the compliance C lumped.
  template <int dim>
  void IterativeStatics<dim>::Preconditioner::set_weights(const Contact<dim> &contact,
                                                          const RowRange &rows)
  {
    const std::vector<double> stiffness = replicate(bodies.stiffness.diagonal());
    D.assign(rows.n_local(), 0);
    soft.assign(rows.n_local(), 1);
    closed.assign(rows.n_local(), 0);
    for (unsigned int row = rows.begin + n_displacements; row < rows.end; ++row)
    {
      PetscInt n                = 0;
      const PetscInt *columns   = nullptr;
      const PetscScalar *values = nullptr;
      SQUEAL_PETSC(MatGetRow(normal, row, &n, &columns, &values));
      double of_bodies = 0, of_contact = 0;
      for (PetscInt k = 0; k < n; ++k)
        if (stiffness[columns[k]] > 0)
          of_bodies += values[k] * values[k] / stiffness[columns[k]];
        else
          of_contact -= values[k];
      SQUEAL_PETSC(MatRestoreRow(normal, row, &n, &columns, &values));
      const unsigned int i = row - rows.begin;
      if (!contact.is_closed(row))
        closed[i] = -1 / of_contact;
      else
      {
        D[i]    = 1 / (of_bodies + of_contact);
        soft[i] = 1 - D[i] * of_contact;
      }
    }
  }

  template <int dim>
  MultiVector IterativeStatics<dim>::Preconditioner::apply(const MultiVector &residual) const
  {
    if (!mortar)
      return bodies.multigrid.apply(residual);
    // Multipliers -D r. Forces r + N D r of the augmentation, and those of the multipliers off.
    MultiVector multipliers(residual.row_range(), 1), augmented = multipliers, forces = residual;
    for (unsigned int i = n_displacements; i < residual.n_local(); ++i)
    {
      const double weighted = D[i] * residual.data()[i];
      augmented.data()[i]   = (1 + soft[i]) * weighted;
      multipliers.data()[i] = closed[i] * residual.data()[i] - weighted;
    }
    forces += multiply_column(normal, augmented);
    if (friction)
      forces -= multiply_column(friction, multipliers);
    MultiVector result = bodies.multigrid.apply(forces);
    result += multipliers;
    return result;
  }

  template <int dim>
  IterativeStatics<dim>::IterativeStatics(const FiniteElementSpace<dim> &spaces,
                                          const std::vector<MaterialOperator> &bodies,
                                          const IterativeOptions &options)
      : spaces(spaces), options(options),
        bodies(std::make_unique<Bodies>(spaces, bodies, options.multigrid))
  {
  }

  template <int dim>
  IterativeStatics<dim>::~IterativeStatics() = default;

  template <int dim>
  double IterativeStatics<dim>::stiffness_scale() const
  {
    const MultiVector &diagonal = bodies->stiffness.diagonal();
    double largest              = 0;
    for (unsigned int i = 0; i < diagonal.n_local(); ++i)
      largest = std::max(largest, diagonal.data()[i]);
    return Utilities::MPI::max(largest, spaces.comm);
  }

  template <int dim>
  LinearOperator IterativeStatics<dim>::tangent(const Contact<dim> &contact,
                                                const ContactPressure &pressure,
                                                const bool with_friction) const
  {
    const auto normal   = std::make_shared<const Matrix>(normal_matrix(contact)),
               friction = std::make_shared<const Matrix>(
                   with_friction ? friction_matrix(contact, pressure) : Matrix());
    return [this, normal, friction](const MultiVector &x)
    { return bodies->multiply(*normal, *friction, x); };
  }

  template <int dim>
  void IterativeStatics<dim>::set_up(const Contact<dim> &contact, const ContactPressure &pressure,
                                     const bool with_friction)
  {
    preconditioner.reset();
    preconditioner =
        std::make_unique<Preconditioner>(spaces, *bodies, contact, pressure, with_friction);
  }

  template <int dim>
  MultiVector IterativeStatics<dim>::cycle(const MultiVector &forces) const
  {
    MultiVector result(forces.row_range(), 0);
    for (unsigned int k = 0; k < forces.n_columns(); ++k)
      result.append(bodies->multigrid.apply(forces.columns(k, 1)));
    return result;
  }

  template <int dim>
  const DisplacementOperator<dim> &IterativeStatics<dim>::stiffness() const
  {
    return bodies->stiffness;
  }

  template <int dim>
  unsigned int IterativeStatics<dim>::solve(const Contact<dim> &contact,
                                            const ContactPressure &pressure,
                                            const bool with_friction, const MultiVector &b,
                                            const double tolerance, MultiVector &x)
  {
    set_up(contact, pressure, with_friction);
    const Preconditioner &B = *preconditioner;
    const auto n_steps      = gmres(
        [&](const MultiVector &v) { return bodies->multiply(B.normal, B.friction, v); },
        [&](const MultiVector &r) { return B.apply(r); }, b, x, tolerance, options.iterations);
    if (!n_steps)
      throw SolverError("The iterative solver of the static equilibrium has not converged in " +
                            std::to_string(options.iterations) + " steps of GMRES",
                        {Failure::gmres_stalled});
    return *n_steps;
  }

  template <int dim>
  std::string IterativeStatics<dim>::description() const
  {
    const std::string on = std::to_string(bodies->multigrid.n_coarse()) +
                           " unknowns of degree 1 by " + name_of(options.multigrid);
    return spaces.fe.degree == 1
               ? on
               : "Chebyshev smoothing on degree " + std::to_string(spaces.fe.degree) + ", " + on;
  }

  template class IterativeStatics<2>;
  template class IterativeStatics<3>;
} // namespace squeal

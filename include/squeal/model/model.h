#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/equations/sector.h>
#include <squeal/linalg/gmres.h>
#include <squeal/parameters/parameters.h>

#include <complex>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// How the equations of motion depend on one parameter: d/dp of their terms.
  struct ParameterDerivative
  {
    std::string parameter; ///< path of the key
    double value;          ///< present value, in the unit of the key
    std::vector<Term> terms;

    /// A term coefficient * factor(l) * matrix, of moduli that depend on l.
    struct OfModulus
    {
      double coefficient;
      std::shared_ptr<const Matrix> matrix;
      std::function<std::complex<double>(std::complex<double>)> factor;
    };
    std::vector<OfModulus> moduli = {};
  };

  /// The equations of motion of a scene as a list of terms: what sweeps, sensitivities and the
  /// search for critical values need to know of it.
  class Model
  {
  public:
    virtual ~Model() = default;

    /// Makes the terms for these parameters, again where they have changed. What does not depend
    /// on what has changed since the last call keeps its matrix. Throws InputError, SolverError.
    ///
    /// With @p nearby, products with the inverse of the position matrix for parameters of an
    /// earlier call that are nearly the same, the static state follows from the last one by
    /// iteration.
    virtual void assemble(const Parameters::All &parameters, const LinearOperator &nearby = {}) = 0;

    /// The terms, and what is known of the problem that they make.
    const EquationsOfMotion &equations() const
    {
      return equations_;
    }
    const std::vector<Term> &terms() const
    {
      return equations_.terms;
    }
    /// What relaxes or has hysteresis, beside the terms.
    const std::vector<RelaxationTerm> &relaxation() const
    {
      return equations_.relaxation;
    }

    /// { M, P, Q } and the reference problem for counting modes.
    QuadraticEigenproblem problem() const
    {
      return sum_of(equations_);
    }

    /// The derivatives of the terms with respect to the parameters that the scene uses, the steady
    /// pressure's own dependence included; the active set of the contact is held fixed. With a
    /// path: of that parameter only, or nothing if the terms cannot be differentiated by it. @p
    /// nearby as in assemble().
    virtual std::vector<ParameterDerivative>
    derivatives(const std::string &only = "", const LinearOperator &nearby = {}) const = 0;

    /// Names of the bodies and, for each row of this rank, the number of its body.
    virtual std::pair<std::vector<std::string>, std::vector<unsigned int>>
    bodies_of_rows() const = 0;

    /// Whether the matrices of inertia, elasticity and transport are known to be semidefinite.
    virtual bool has_semidefinite_terms() const
    {
      return false;
    }

    /// The sectors that the mesh has, and that the parameters allow for.
    virtual Sectors sectors() const
    {
      return {};
    }

  protected:
    EquationsOfMotion equations_; ///< of the last assemble()
  };

  /// Makes a model with a mesh of its own, where a parameter changes the mesh.
  using ModelFactory = std::function<std::unique_ptr<Model>(const Parameters::All &)>;
} // namespace squeal

#pragma once

#include <squeal/model/model.h>

namespace squeal
{
  /// Matrix Market files instead of bodies: M q'' + c P q' + (K + p N) q = 0, and stiffness
  /// f(l) c A that depends on how fast it is strained.
  class MatrixModel : public Model
  {
  public:
    /// Reads the files. Throws InputError.
    MatrixModel(const Parameters::Matrices &names, MPI_Comm comm);

    void assemble(const Parameters::All &parameters, const LinearOperator &nearby = {}) override;
    std::vector<ParameterDerivative> derivatives(const std::string &only,
                                                 const LinearOperator &nearby = {}) const override;

    std::pair<std::vector<std::string>, std::vector<unsigned int>> bodies_of_rows() const override
    {
      return {{"all"}, std::vector<unsigned int>(rows.n_local(), 0)};
    }

    unsigned int size() const
    {
      return rows.size;
    }

    /// What is unusual about the stiffnesses, each line beginning with "Warning".
    const std::vector<std::string> &doubts() const
    {
      return doubts_;
    }

  private:
    RowRange rows;
    std::vector<std::string> doubts_;
    std::shared_ptr<const Matrix> mass, velocity, stiffness, circulatory;
    std::vector<std::shared_ptr<const Matrix>> viscoelastic; ///< null where there is none
    double circulatory_factor = 1, velocity_factor = 1, damping_factor = 1;
  };
} // namespace squeal

#include <squeal/eigen/given_matrices.h>

#include <map>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// On every rank.
    struct WholeVector
    {
      std::vector<double> re, im;
    };

    /// z_j^H A x_j summed in long numbers, the same on all ranks. x are whole vectors.
    std::vector<Complex> long_forms(const RowRange &rows, const ComplexMultiVector &z,
                                    const Matrix &matrix, const std::vector<WholeVector> &x)
    {
      std::vector<long double> sums(2 * x.size());
      for_entries(matrix,
                  [&](const PetscInt row, const PetscInt column, const long double entry)
                  {
                    for (unsigned int j = 0; j < x.size(); ++j)
                    {
                      const Complex of_z     = z(row - rows.begin, j);
                      const long double z_re = of_z.real(), z_im = of_z.imag(),
                                        x_re = x[j].re[column], x_im = x[j].im[column];
                      sums[2 * j] += entry * (z_re * x_re + z_im * x_im);
                      sums[2 * j + 1] += entry * (z_re * x_im - z_im * x_re);
                    }
                  });
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_LONG_DOUBLE, MPI_SUM, rows.comm);
      std::vector<Complex> forms;
      for (unsigned int j = 0; j < x.size(); ++j)
        forms.emplace_back(double(sums[2 * j]), double(sums[2 * j + 1]));
      return forms;
    }
  } // namespace

  void use_given_matrices(const QuadraticEigenproblem &problem, EigenPairs &modes)
  {
    const EquationsOfMotion &given = *problem.given;
    const unsigned int n           = modes.size();
    std::vector<WholeVector> x;
    for (unsigned int j = 0; j < n; ++j)
      x.push_back(
          {replicate(modes.right.re.columns(j, 1)), replicate(modes.right.im.columns(j, 1))});
    std::map<Mat, std::vector<Complex>> known; // terms share matrices
    const auto forms = [&](const Matrix &matrix) -> const std::vector<Complex> &
    {
      std::vector<Complex> &result = known[matrix.stored()];
      if (result.size() != n)
        result = long_forms(problem.rows, modes.left, matrix, x);
      return result;
    };
    RayleighCorrections corrections(modes.lambda);
    for (const Term &term : given.terms)
      corrections.add(term.order, term.coefficient, forms(*term.matrix));
    for (unsigned int k = 0; k < problem.frozen.size(); ++k)
    {
      const RelaxationTerm &term = given.relaxation[k];
      corrections.add(problem.frozen[k], term.low_rank
                                             ? diagonal_form(modes.left, *term.matrix, modes.right)
                                             : forms(*term.matrix));
    }
    const std::vector<Complex> values = corrections.values();
    for (unsigned int j = 0; j < n; ++j)
      modes.lambda[j] -= modes.lambda[j].imag() == 0 ? values[j].real() : values[j];
  }
} // namespace squeal

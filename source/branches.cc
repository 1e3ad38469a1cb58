#include <squeal/branches.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>

namespace squeal
{
  namespace
  {
    template <typename Number>
    void write_numbers(std::ostream &out, const Number *numbers, const std::size_t n)
    {
      const std::uint64_t size = n;
      out.write(reinterpret_cast<const char *>(&size), sizeof(size));
      out.write(reinterpret_cast<const char *>(numbers), n * sizeof(Number));
    }

    template <typename Number>
    bool read_numbers(std::istream &in, std::vector<Number> &numbers)
    {
      std::uint64_t size = 0;
      if (!in.read(reinterpret_cast<char *>(&size), sizeof(size)) || size > (1ull << 40))
        return false;
      numbers.resize(size);
      return bool(in.read(reinterpret_cast<char *>(numbers.data()), size * sizeof(Number)));
    }

    constexpr std::array<Block Modes::*, 6> blocks = {{&Modes::re, &Modes::im, &Modes::left_re,
                                                       &Modes::left_im, &Modes::right_basis,
                                                       &Modes::left_basis}};
    constexpr std::array<std::vector<double> Modes::*, 3> lists = {
        {&Modes::backward_error, &Modes::left_backward_error, &Modes::condition}};
  } // namespace

  void BranchPoint::save(const std::string &filename,
                         const std::vector<std::uintmax_t> &tables) const
  {
    const std::string unfinished = filename + ".part";
    {
      std::ofstream out(unfinished, std::ios::binary);
      const RowRange &rows        = modes.re.row_range();
      const std::uint64_t range[] = {rows.begin, rows.end, rows.size, n_branches};
      write_numbers(out, range, 4);
      write_numbers(out, &value, 1);
      write_numbers(out, tables.data(), tables.size());
      write_numbers(out, branches.data(), branches.size());
      write_numbers(out, overlaps.data(), overlaps.size());
      write_numbers(out, modes.lambda.data(), modes.lambda.size());
      write_numbers(out, modes.disc_lambda.data(), modes.disc_lambda.size());
      for (const auto list : lists)
        write_numbers(out, (modes.*list).data(), (modes.*list).size());
      for (const auto block : blocks)
        write_numbers(out, (modes.*block).data(),
                      std::size_t((modes.*block).n_local()) * (modes.*block).n_columns());
      if (!out.flush())
        throw std::runtime_error("The file " + unfinished +
                                 " cannot be written; is the disk full?");
    }
    std::filesystem::rename(unfinished, filename);
  }

  bool BranchPoint::load(const std::string &filename,
                         const std::function<RowRange(double value)> &rows_of,
                         std::vector<std::uintmax_t> &tables)
  {
    std::ifstream in(filename, std::ios::binary);
    std::vector<std::uint64_t> range;
    std::vector<double> values;
    if (!in || !read_numbers(in, range) || range.size() != 4 || !read_numbers(in, values) ||
        values.size() != 1)
      return false;
    n_branches          = range[3];
    value               = values[0];
    const RowRange rows = rows_of(value);
    if (range[0] != rows.begin || range[1] != rows.end || range[2] != rows.size ||
        !read_numbers(in, tables) || !read_numbers(in, branches) || !read_numbers(in, overlaps) ||
        !read_numbers(in, modes.lambda) || !read_numbers(in, modes.disc_lambda))
      return false;
    for (const auto list : lists)
      if (!read_numbers(in, modes.*list))
        return false;
    for (const auto block : blocks)
    {
      if (!read_numbers(in, values))
        return false;
      if (rows.n_local() == 0 || values.size() % rows.n_local() != 0)
        return false;
      modes.*block = Block(rows, values.size() / rows.n_local());
      std::copy(values.begin(), values.end(), (modes.*block).data());
    }
    return true;
  }

  bool continue_branches(const QuadraticEigenproblem &problem, const BranchPoint &before,
                         const double max_imaginary, BranchPoint &next)
  {
    const unsigned int n = before.modes.lambda.size(), m = next.modes.lambda.size();
    const auto form =
        biorthogonality(problem, before.modes.lambda, before.modes.left_re, before.modes.left_im,
                        next.modes.lambda, next.modes.re, next.modes.im);
    std::vector<std::vector<double>> overlap(n, std::vector<double>(m)), cost = overlap;
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < m; ++j)
      {
        overlap[i][j] = std::abs(form[i + std::size_t(j) * n] / (2. * before.modes.lambda[i]));
        // The nearness of the eigenvalues decides only where overlaps do not.
        const double distance = std::abs(next.modes.lambda[j] - before.modes.lambda[i]) /
                                std::abs(before.modes.lambda[i]);
        cost[i][j] = std::pow(1 - std::min(1., overlap[i][j]), 2) + 1e-3 * std::min(1., distance);
      }
    const std::vector<int> partners = assign(cost, m);

    next.branches.assign(m, 0);
    next.overlaps.assign(m, 0.);
    next.n_branches = before.n_branches;
    std::vector<bool> continued(m, false);
    const auto near_rim = [&](const std::complex<double> l)
    { return std::abs(l.imag()) > 0.99 * max_imaginary; };
    bool certain = true;
    for (unsigned int i = 0; i < n; ++i)
    {
      const int j = partners[i];
      if (j >= 0 && overlap[i][j] > 0.1)
      {
        next.branches[j] = before.branches[i];
        next.overlaps[j] = overlap[i][j];
        continued[j]     = true;
        for (unsigned int k = 0; k < m; ++k)
          certain &= int(k) == j || near_rim(before.modes.lambda[i]) ||
                     overlap[i][k] < 0.5 * overlap[i][j];
      }
      certain &= near_rim(before.modes.lambda[i]) || (j >= 0 && overlap[i][j] > 0.8);
    }
    for (unsigned int j = 0; j < m; ++j)
      if (!continued[j])
      {
        certain &= near_rim(next.modes.lambda[j]);
        next.branches[j] = next.n_branches++;
      }
    return certain;
  }

  void continue_by_eigenvalues(const BranchPoint &before, BranchPoint &next)
  {
    constexpr double farthest = 0.1;
    const unsigned int n = before.modes.lambda.size(), m = next.modes.lambda.size();
    std::vector<std::vector<double>> cost(n, std::vector<double>(m));
    for (unsigned int i = 0; i < n; ++i)
      for (unsigned int j = 0; j < m; ++j)
        cost[i][j] = std::norm(before.modes.lambda[i] - next.modes.lambda[j]);
    const std::vector<int> partners = assign(cost, m);
    next.branches.assign(m, 0);
    next.overlaps.assign(m, 0.);
    next.n_branches = before.n_branches;
    std::vector<bool> continued(m, false);
    for (unsigned int i = 0; i < n; ++i)
      if (const int j = partners[i];
          j >= 0 && cost[i][j] <= farthest * farthest * std::norm(before.modes.lambda[i]))
      {
        next.branches[j] = before.branches[i];
        continued[j]     = true;
      }
    for (unsigned int j = 0; j < m; ++j)
      if (!continued[j])
        next.branches[j] = next.n_branches++;
  }
} // namespace squeal

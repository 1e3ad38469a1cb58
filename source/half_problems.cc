#include <squeal/half_problems.h>
#include <squeal/half_space.h>
#include <squeal/memory.h>

#include <algorithm>
#include <numeric>

namespace squeal
{
  namespace
  {
    /// What both halves found, one after the other, as vectors of the whole.
    void append(const HalfSpace &space, const Modes &half, const std::string &name, Modes &modes)
    {
      const auto join = [](auto &all, const auto &more)
      { all.insert(all.end(), more.begin(), more.end()); };
      join(modes.lambda, half.lambda);
      join(modes.disc_lambda, half.disc_lambda);
      join(modes.backward_error, half.backward_error);
      join(modes.left_backward_error, half.left_backward_error);
      join(modes.condition, half.condition);
      modes.mirror.insert(modes.mirror.end(), half.lambda.size(), name);
      for (Block Modes::*block : {&Modes::re, &Modes::im, &Modes::left_re, &Modes::left_im})
        (modes.*block).append(space.expand(half.*block));
      modes.completeness += (modes.completeness.empty() ? "" : "; ") + name + ", " +
                            std::to_string(space.row_range().size) +
                            " unknowns: " + half.completeness;
      modes.n_reference += half.n_reference;
      modes.n_rigid_body_modes += half.n_rigid_body_modes;
      modes.n_solves += half.n_solves;
      modes.factor_memory_mib    = std::max(modes.factor_memory_mib, half.factor_memory_mib);
      modes.predicted_memory_mib = std::max(modes.predicted_memory_mib, half.predicted_memory_mib);
      modes.seconds.counting += half.seconds.counting;
      modes.seconds.factorization += half.seconds.factorization;
      modes.seconds.right += half.seconds.right;
      modes.seconds.left += half.seconds.left;
    }

    void sort_by_frequency(Modes &modes)
    {
      std::vector<unsigned int> order(modes.lambda.size());
      std::iota(order.begin(), order.end(), 0u);
      std::stable_sort(order.begin(), order.end(),
                       [&](const unsigned int a, const unsigned int b)
                       { return precedes(modes.lambda[a], modes.lambda[b]); });
      const Pairs right = select({modes.lambda, modes.re, modes.im}, order),
                  left  = select({modes.lambda, modes.left_re, modes.left_im}, order);
      modes.lambda      = right.lambda;
      modes.re          = right.re;
      modes.im          = right.im;
      modes.left_re     = left.re;
      modes.left_im     = left.im;
      const auto sort   = [&](auto &values)
      {
        const auto all = values;
        for (unsigned int k = 0; k < order.size(); ++k)
          values[k] = all[order[k]];
      };
      sort(modes.mirror);
      sort(modes.backward_error);
      sort(modes.left_backward_error);
      sort(modes.condition);
    }
  } // namespace

  Modes solve_by_symmetry(const Eigensolver &solver, const EquationsOfMotion &equations,
                          const EigensolverOptions &options,
                          const std::optional<MirrorSymmetry> &symmetry)
  {
    if (!symmetry || !is_symmetric(equations, *symmetry))
      return solver.solve(sum_of(equations), options);
    Modes modes;
    for (Block Modes::*block : {&Modes::re, &Modes::im, &Modes::left_re, &Modes::left_im})
      modes.*block = Block(equations.rows, 0);
    for (const std::string name : {"symmetric", "antisymmetric"})
    {
      const HalfSpace space(*symmetry, name == "symmetric");
      auto half = std::make_shared<Modes>(solver.solve(space.restrict(equations), options));
      append(space, *half, name, modes);
      if (options.keep_factors)
        modes.halves.push_back(half);
      half.reset();
      return_freed_memory();
    }
    sort_by_frequency(modes);
    turn_to_real(modes);
    return modes;
  }
} // namespace squeal

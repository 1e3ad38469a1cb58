#include <squeal/eigen/growth_search.h>
#include <squeal/studies/path.h>
#include <squeal/studies/study_points.h>

#include <algorithm>
#include <numeric>

namespace squeal
{
  using Complex = std::complex<double>;
  using Scope   = ModeTracker::Scope;

  Path::Path(VariedModel &varied, const ModelFactory &make_model, const MPI_Comm comm, Log &log)
      : varied(varied), tracker(varied.tracker), parameter(varied.parameters.front()),
        keeps_mesh_(Parameters::Sweep::keeps_mesh(parameter)), make_model(make_model), comm(comm),
        log(log)
  {
    need_effect(parameter, bool(make_model));
  }

  void Path::make_mesh(const double value)
  {
    own_model.reset(); // two meshes at a time would double the memory
    own_model = make_model(varied.parameters_at({value}));
    tracker.set_model(*own_model);
  }

  bool Path::is_allowed(const double value)
  {
    try
    {
      varied.parameters_at({value});
      return true;
    }
    catch (const InputError &)
    {
      return false;
    }
  }

  BranchPoint Path::solve(const double value, const Scope scope, const bool fully)
  {
    if (!keeps_mesh_)
      make_mesh(value);
    const Parameters::All &parameters = varied.parameters_at({value});
    EigenSolution found =
        fully ? tracker.solve_fully(parameters, scope) : tracker.solve(parameters, scope);
    BranchPoint point;
    point.value = value;
    point.modes = std::move(found.modes);
    point.reuse = std::move(found.reuse);
    point.rows  = tracker.analyse(point.modes);
    if (found.proof.lacks_growing)
      log.line("  At " + number(value) + ": " + lacking_growth);
    return point;
  }

  void Path::begin_branches(BranchPoint &point)
  {
    point.n_branches = point.modes.size();
    point.branches.resize(point.n_branches);
    std::iota(point.branches.begin(), point.branches.end(), 0u);
    point.overlaps.assign(point.n_branches, 0.);
  }

  BranchPoint Path::advance(const BranchPoint &from, BranchPoint to, const OnStep &on_step,
                            const Scope scope, const unsigned int n_halvings)
  {
    const std::vector<Complex> transition = tracker.transition(from.modes, to.modes);
    const bool is_certain = continue_branches(transition, from, varied.options.max_imaginary, to);
    const double value = to.value, middle = (from.value + value) / 2;
    if (!is_certain && n_halvings < max_halvings && is_allowed(middle))
    {
      const BranchPoint between =
          advance(from, solve(middle, Scope::disc), on_step, Scope::disc, n_halvings + 1);
      if (!tracker.is_whole(to.modes)) // its coordinates may be those of older bases
        return advance(between, solve(value, scope), on_step, scope, n_halvings + 1);
      tracker.assemble(varied.parameters_at({value}));
      const std::vector<unsigned int> straight = to.branches;
      to = advance(between, std::move(to), on_step, scope, n_halvings + 1);
      // The way by the middle leads through the disc only.
      for (unsigned int j = 0; j < straight.size(); ++j)
        if (grows_beyond_disc(to.modes.lambda[j], varied.options.max_imaginary) &&
            straight[j] < from.n_branches && to.index_of(straight[j]) < 0)
          to.branches[j] = straight[j];
      return to;
    }
    if (!is_certain)
      log.line(
          "  Branches between " + number(from.value) + " and " + number(value) +
          " meet or come too close to be told apart by their vectors: continued by the nearest "
          "eigenvalues.");
    on_step(from, to, transition);
    return to;
  }

  void Path::advance_on_new_mesh(const BranchPoint &from, BranchPoint &to)
  {
    const RowRange &old_rows = from.modes.right.row_range(), &new_rows = to.modes.right.row_range();
    int same = old_rows.begin == new_rows.begin && old_rows.end == new_rows.end &&
               old_rows.size == new_rows.size;
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, comm);
    const bool is_certain = same && continue_branches(tracker.transition(from.modes, to.modes),
                                                      from, varied.options.max_imaginary, to);
    if (!same)
      continue_by_eigenvalues(from, to);
    const std::string place = number(from.value) + " and " + number(to.value);
    if (!is_certain)
      log.line("  Branches between " + place +
               (same ? " are not told apart with certainty by their vectors."
                     : text_of(" are continued by the nearest eigenvalues: the mesh has ",
                               new_rows.size, " unknowns instead of ", old_rows.size, ".")));
    for (unsigned int i = 0; i < from.branches.size(); ++i)
      if (const int at = to.index_of(from.branches[i]); at >= 0)
      {
        const Complex a = from.modes.lambda[i], b = to.modes.lambda[at];
        if (!varied.is_marginal(a) && !varied.is_marginal(b) && a.real() * b.real() < 0)
          log.line(text_of("  The growth rate of branch ", from.branches[i] + 1,
                           " changes its sign between ", place, "."));
      }
  }
} // namespace squeal

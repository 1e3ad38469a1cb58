#include <squeal/sweep.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

namespace squeal
{
  using Complex = std::complex<double>;

  Sweep::Sweep(ParameterFile &file, Model &model, const EigensolverOptions &options,
               const std::string &directory, const MPI_Comm comm, Log &log)
      : file(file), model(model), parameter(file.parameters().sweep.parameter), options(options),
        directory(directory), comm(comm), log(log),
        solver(make_eigensolver(file.parameters().eigenproblem.solver))
  {
    // Meshes and geometry stay as they are.
    const std::vector<std::string> allowed = {"Operation/",     "Contact/",
                                              "Pads/Pressure",  "Rotor/Material/",
                                              "Pads/Material/", "Matrices/Circulatory factor"};
    file.value_of(parameter);
    if (std::none_of(allowed.begin(), allowed.end(),
                     [&](const std::string &start) { return parameter.rfind(start, 0) == 0; }))
      throw InputError("Sweep/Parameter = " + parameter +
                       ": a sweep keeps the mesh. Allowed are numbers of the sections Operation, "
                       "Contact, Rotor/Material, Pads/Material, and Pads/Pressure, "
                       "Matrices/Circulatory factor.");
  }

  std::string Sweep::state_file() const
  {
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    return directory + "/sweep-" + std::to_string(rank) + ".state";
  }

  void Sweep::solve(const double value, const BranchPoint *before, BranchPoint &point)
  {
    file.vary(parameter, value);
    model.assemble(file.parameters());
    problem     = model.problem();
    point.value = value;
    point.modes =
        before ? solver->follow(problem, options, before->modes) : solver->solve(problem, options);
  }

  BranchPoint Sweep::advance(const BranchPoint &from, const double value,
                             const unsigned int n_halvings)
  {
    BranchPoint to;
    solve(value, &from, to);
    const bool certain = continue_branches(problem, from, options.max_imaginary, to);
    if (!certain && n_halvings < max_halvings)
    {
      const BranchPoint middle = advance(from, (from.value + value) / 2, n_halvings + 1);
      return advance(middle, value, n_halvings + 1);
    }
    if (!certain)
      log.line(
          "  Branches between " + number(from.value) + " and " + number(value) +
          " meet or come too close to be told apart by their vectors: continued by the nearest "
          "eigenvalues.");
    if (file.parameters().sweep.critical_values)
      find_critical_values(from, to);
    return to;
  }

  void Sweep::write(const BranchPoint &point)
  {
    const std::vector<ModeRow> rows = analyse(problem, point.modes, 0, options.tolerance);
    unsigned int n_unstable         = 0;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      std::vector<std::string> fields = {number(point.value), std::to_string(point.branches[j])};
      const auto of_mode              = modes_fields(rows[j]);
      fields.insert(fields.end(), of_mode.begin(), of_mode.end());
      fields.push_back(point.overlaps[j] > 0 ? number(point.overlaps[j]) : "");
      sweep_csv->add(fields);
      n_unstable += rows[j].verdict == "flutter" || rows[j].verdict == "divergence";
    }
    const auto worst = std::max_element(rows.begin(), rows.end(),
                                        [](const ModeRow &a, const ModeRow &b)
                                        { return a.growth_rate() < b.growth_rate(); });
    char text[160];
    std::snprintf(
        text, sizeof(text), "  %14.6g   %5zu   %8u   %s", point.value, rows.size(), n_unstable,
        worst == rows.end()
            ? "-"
            : (number(worst->growth_rate()) + " at " + number(worst->frequency()) + " Hz").c_str());
    log.line(text);
  }

  void Sweep::save(const BranchPoint &point) const
  {
    std::vector<std::uintmax_t> sizes;
    MPI_Barrier(comm);
    for (const char *name : {"/sweep.csv", "/critical.csv"})
      sizes.push_back(std::filesystem::exists(directory + name)
                          ? std::filesystem::file_size(directory + name)
                          : 0);
    point.save(state_file(), sizes);
    MPI_Barrier(comm);
  }

  bool Sweep::resume(BranchPoint &last, unsigned int &n_done)
  {
    const std::vector<double> points = file.parameters().sweep.points();
    std::vector<std::uintmax_t> sizes;
    // The rows of this rank are known once the operators are.
    int there = std::filesystem::exists(state_file());
    MPI_Allreduce(MPI_IN_PLACE, &there, 1, MPI_INT, MPI_MIN, comm);
    if (!there)
      return false;
    file.vary(parameter, points.front());
    model.assemble(file.parameters());
    const RowRange rows = model.problem().rows;
    int good            = last.load(state_file(), rows, sizes) && sizes.size() == 2;
    const auto at       = std::find(points.begin(), points.end(), last.value);
    good                = good && at != points.end();
    MPI_Allreduce(MPI_IN_PLACE, &good, 1, MPI_INT, MPI_MIN, comm);
    if (!good)
      return false;
    n_done = at - points.begin() + 1;
    if (is_rank_zero(comm)) // a line may have been cut
      for (unsigned int k = 0; k < 2; ++k)
      {
        const std::string name = directory + (k == 0 ? "/sweep.csv" : "/critical.csv");
        if (std::filesystem::exists(name))
          std::filesystem::resize_file(name, sizes[k]);
      }
    MPI_Barrier(comm);
    log.line("Resumed after " + std::to_string(n_done) + " of " + std::to_string(points.size()) +
             " values: " + parameter + " = " + number(last.value) + ".");
    return true;
  }

  void Sweep::run()
  {
    const std::vector<double> points = file.parameters().sweep.points();
    const double original            = file.value_of(parameter);
    BranchPoint last;
    unsigned int n_done = 0;
    const bool resumed  = resume(last, n_done);
    sweep_csv           = std::make_unique<Table>(
        directory + "/sweep.csv", std::string("parameter,branch,") + modes_header + ",overlap",
        comm, resumed);
    if (file.parameters().sweep.critical_values)
      critical_csv = std::make_unique<Table>(
          directory + "/critical.csv",
          "kind,parameter,value,accuracy,frequency_hz,growth_rate_1_per_s,branch,other_branch,"
          "iterations",
          comm, resumed);
    log.line("\nSweep over " + parameter +
             "\n           value   modes   unstable   largest growth "
             "rate, 1/s");
    for (unsigned int k = n_done; k < points.size(); ++k)
    {
      if (k == 0)
      {
        solve(points[0], nullptr, last);
        last.n_branches = last.modes.lambda.size();
        for (unsigned int j = 0; j < last.n_branches; ++j)
          last.branches.push_back(j);
        last.overlaps.assign(last.n_branches, 0.);
      }
      else
      {
        BranchPoint next = advance(last, points[k], 0);
        last             = std::move(next);
        // The search for critical values went elsewhere.
        if (file.value_of(parameter) != points[k])
        {
          file.vary(parameter, points[k]);
          model.assemble(file.parameters());
          problem = model.problem();
        }
      }
      write(last);
      save(last);
    }
    file.vary(parameter, original);
    MPI_Barrier(comm);
    std::error_code ignored;
    std::filesystem::remove(state_file(), ignored);
  }

  Sweep::Evaluation Sweep::evaluate(const double value, const BranchPoint &near,
                                    const std::vector<Complex> &expected)
  {
    BranchPoint point;
    solve(value, &near, point);
    Evaluation result;
    const std::vector<unsigned int> chosen = nearest_partners(expected, point.modes.lambda);
    if (chosen.size() < expected.size())
      throw SolverError("A mode was lost in the search for a critical value of " + parameter + ".");
    std::vector<Complex> derivatives;
    for (const ParameterDerivative &derivative : model.derivatives(parameter))
      derivatives = sensitivities(derivative, point.modes);
    for (const unsigned int j : chosen)
    {
      result.lambda.push_back(point.modes.lambda[j]);
      result.derivative.push_back(derivatives.empty() ? Complex(std::nan(""), 0) : derivatives[j]);
    }
    return result;
  }

  void Sweep::report(const Critical &critical)
  {
    critical_csv->add({critical.kind, parameter, number(critical.value), number(critical.accuracy),
                       number(std::abs(critical.lambda.imag()) / (2 * M_PI)),
                       number(critical.lambda.real()), std::to_string(critical.branch),
                       critical.other < 0 ? "" : std::to_string(critical.other),
                       std::to_string(critical.iterations)});
    log.line("  Critical: " + critical.kind + " of branch " + std::to_string(critical.branch) +
             (critical.other < 0 ? "" : " with branch " + std::to_string(critical.other)) + " at " +
             parameter + " = " + number(critical.value) + " (+- " + number(critical.accuracy) +
             "), " + number(std::abs(critical.lambda.imag()) / (2 * M_PI)) + " Hz");
  }

  void Sweep::find_critical_values(const BranchPoint &from, const BranchPoint &to)
  {
    const auto index = [](const BranchPoint &point, const unsigned int branch)
    {
      const auto at = std::find(point.branches.begin(), point.branches.end(), branch);
      return at == point.branches.end() ? -1 : int(at - point.branches.begin());
    };
    const auto is_marginal = [&](const Complex l)
    { return std::abs(l.real()) <= 10 * options.tolerance * std::abs(l); };
    // A pair whose mean and difference squared are real (up to the common factor of the motion)
    // meets where the squared difference changes its sign.
    const auto squared_half_difference = [](const Complex a, const Complex b)
    { return (a - b) * (a - b) / 4.; };

    for (unsigned int i = 0; i < from.branches.size(); ++i)
    {
      const int at = index(to, from.branches[i]);
      if (at < 0)
        continue;
      const Complex a = from.modes.lambda[i], b = to.modes.lambda[at];
      if (!is_marginal(a) && !is_marginal(b) && a.real() * b.real() < 0)
        report(onset(from, to, from.branches[i]));
      for (unsigned int k = i + 1; k < from.branches.size(); ++k)
      {
        const int at_k = index(to, from.branches[k]);
        if (at_k < 0)
          continue;
        const Complex before = squared_half_difference(a, from.modes.lambda[k]),
                      after  = squared_half_difference(b, to.modes.lambda[at_k]);
        const auto is_real   = [](const Complex x)
        { return std::abs(x.imag()) <= 1e-3 * std::abs(x); };
        if (is_real(before) && is_real(after) && before.real() * after.real() < 0)
          report(coalescence(from, to, from.branches[i], from.branches[k]));
      }
    }
  }

  Sweep::Critical Sweep::onset(const BranchPoint &from, const BranchPoint &to,
                               const unsigned int branch)
  {
    const auto eigenvalue = [&](const BranchPoint &point)
    {
      return point.modes.lambda[std::find(point.branches.begin(), point.branches.end(), branch) -
                                point.branches.begin()];
    };
    Critical result;
    result.kind   = eigenvalue(from).real() < 0 ? "onset" : "end";
    result.branch = branch;
    double low = from.value, high = to.value, low_growth = eigenvalue(from).real();
    double low_value   = low;
    Complex low_lambda = eigenvalue(from), high_lambda = eigenvalue(to);
    // Regula falsi to begin with.
    double p = low - low_growth * (high - low) / (high_lambda.real() - low_growth);
    for (result.iterations = 1; result.iterations <= 30; ++result.iterations)
    {
      const Complex expected =
          low_lambda + (p - low_value) / (high - low_value) * (high_lambda - low_lambda);
      const Evaluation at = evaluate(p, from, {expected});
      result.lambda       = at.lambda[0];
      const double growth = at.lambda[0].real(), slope = at.derivative[0].real();
      if (growth * low_growth > 0)
      {
        low        = p;
        low_value  = p;
        low_lambda = at.lambda[0];
        low_growth = growth;
      }
      else
      {
        high        = p;
        high_lambda = at.lambda[0];
      }
      double next = std::isfinite(slope) && slope != 0 ? p - growth / slope : (low + high) / 2;
      if ((next - low) * (next - high) > 0) // Newton left the interval
        next = (low + high) / 2;
      result.accuracy = std::abs(next - p);
      const bool done =
          std::abs(next - p) <= 1e-11 * std::max(std::abs(p), std::abs(to.value)) || growth == 0;
      p = next;
      if (done)
        break;
    }
    result.value = p;
    return result;
  }

  Sweep::Critical Sweep::coalescence(const BranchPoint &from, const BranchPoint &to,
                                     const unsigned int branch, const unsigned int other)
  {
    const auto pair = [&](const BranchPoint &point)
    {
      std::vector<Complex> lambda;
      for (const unsigned int b : {branch, other})
        lambda.push_back(
            point.modes.lambda[std::find(point.branches.begin(), point.branches.end(), b) -
                               point.branches.begin()]);
      return lambda;
    };
    const auto discriminant = [](const std::vector<Complex> &l)
    { return ((l[0] - l[1]) * (l[0] - l[1]) / 4.).real(); };
    Critical result;
    result.kind   = "coalescence";
    result.branch = branch;
    result.other  = other;
    double low = from.value, high = to.value;
    const std::vector<Complex> low_pair = pair(from), high_pair = pair(to);
    double low_d = discriminant(low_pair), high_d = discriminant(high_pair);
    double p = low - low_d * (high - low) / (high_d - low_d);
    for (result.iterations = 1; result.iterations <= 30; ++result.iterations)
    {
      const double share = (p - from.value) / (to.value - from.value);
      const Complex mean = (low_pair[0] + low_pair[1]) / 2. * (1 - share) +
                           (high_pair[0] + high_pair[1]) / 2. * share;
      const double d           = low_d + (high_d - low_d) * (p - low) / (high - low);
      const Complex half       = std::sqrt(Complex(d));
      const Evaluation at      = evaluate(p, from, {mean + half, mean - half});
      const Complex difference = at.lambda[0] - at.lambda[1],
                    change     = at.derivative[0] - at.derivative[1];
      const double value = discriminant(at.lambda), slope = (difference * change / 2.).real();
      if (value * low_d > 0)
      {
        low   = p;
        low_d = value;
      }
      else
      {
        high   = p;
        high_d = value;
      }
      double next   = std::isfinite(slope) && slope != 0
                          ? p - value / slope
                          : low - low_d * (high - low) / (high_d - low_d);
      result.lambda = (at.lambda[0] + at.lambda[1]) / 2. +
                      (at.derivative[0] + at.derivative[1]) / 2. * (next - p);
      const double step = std::abs(next - p), range = std::abs(to.value - from.value);
      // The discriminant is smooth: the error of the last step is of the order of its square.
      // Nearer to the double root the eigenvalues themselves lose half of their digits, so this is
      // where to stop.
      const bool near = std::abs(difference) <= 2e-3 * std::abs(at.lambda[0]);
      result.accuracy = std::max(step * step / range, 1e-12 * std::abs(next));
      const bool done = near && step * step <= 1e-9 * range * std::max(std::abs(p), range);
      if (!done && (next - low) * (next - high) > 0) // Newton left the interval
        next = (low + high) / 2;
      p = next;
      if (done)
        break;
    }
    result.value = p;
    return result;
  }
} // namespace squeal

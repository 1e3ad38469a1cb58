#include <squeal/assessment/stability.h>
#include <squeal/bars/changed_edges.h>
#include <squeal/bars/element_problems.h>
#include <squeal/bars/enriched_residuals.h>
#include <squeal/bars/error_estimators.h>
#include <squeal/bars/local_problems.h>
#include <squeal/bars/locking.h>
#include <squeal/bars/second_sides.h>
#include <squeal/bars/static_correction.h>
#include <squeal/bars/surface_vectors.h>
#include <squeal/bars/yielding_bodies.h>
#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/contact/contact_matrices.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

// Bars of eigenvalues by local problems (theory.md, section 6). Estimator::run() shows the order:
// products Z^H Q+ X of the interpolated vectors; shares of the residuals on faces, which several
// cells have; elimination of the complement W cell by cell, which gives T and its parts by cells
// and by kinds of cells; then the effects that are no residual of a cell: the steady pressure's own
// error, other edges of the contact zone, locking. bound_errors() makes bars of them.

namespace squeal
{
  using namespace dealii;
  using Complex = std::complex<double>;

  namespace
  {
    /// The multiple of the elastic moduli that is nearest to the viscous ones, C : C_v / C : C, s.
    template <int dim>
    double viscous_proportion(const Material &material)
    {
      const auto elastic = elasticity_tensor<dim>(material),
                 viscous = elasticity_tensor(ElasticModuli<dim>(material.viscosity, material.axis));
      return std::inner_product(elastic.begin(), elastic.end(), viscous.begin(), 0.) /
             std::inner_product(elastic.begin(), elastic.end(), elastic.begin(), 0.);
    }

    /// A thousandth of the square of the least frequency.
    double shift_of(const EigenPairs &modes)
    {
      double least = std::abs(modes.lambda[0]);
      for (const Complex l : modes.lambda)
        least = std::min(least, std::abs(l));
      return 1e-3 * least * least;
    }

    /// Local problems on the enriched space, and what they make of the residuals.
    template <int dim>
    class Estimator
    {
    public:
      Estimator(const BrakeModel<dim> &model, const EigenPairs &modes);
      EigenvalueErrors run();

    private:
      using CellIterator = typename DoFHandler<dim>::active_cell_iterator;
      using Kind         = std::vector<unsigned int>;
      void share_faces();
      double share(unsigned int index, double resistance) const;
      /// Whether the cell is part of an element with own polynomials: the element has the problem.
      bool is_part(const CellIterator &cell) const
      {
        return elements && cell->level() == 0 && space.base.geometry.own.has(cell->index());
      }
      /// Adds Z^H Q+ X to T.
      void add_products();
      void eliminate(EigenvalueErrors &errors);
      void eliminate_elements(EigenvalueErrors &errors);
      DenseMatrix add_answer(LocalProblem &problem, const DenseMatrix &r, DenseMatrix softer,
                             const ComplexDenseMatrix &of_body, unsigned int material,
                             const Kind &kind, std::vector<std::complex<float>> &parts);
      /// Local indices of a cell's or an element's displacements, with what it has of residuals
      /// there.
      using Places = std::vector<std::pair<unsigned int, double>>;
      Places places_of_cell(unsigned int number) const;
      Places places_of_element(unsigned int e) const;
      void find_answers_of_bodies();
      ComplexDenseMatrix answer_of_body(const Places &places) const;
      DenseMatrix soften(unsigned int number, unsigned int material, const LocalProblem &problem);
      std::vector<ErrorEffects::Alternatives> other_edges(EigenvalueErrors &errors);
      std::vector<ErrorEffects::Alternatives> edges_of_joints();
      void add_state_correction(const DenseMatrix &functions, unsigned int number,
                                const std::vector<int> &unknowns, const double *solution);
      void add_effect_of_pressure(ErrorEffects &effects);
      double share_of_tension(const ContactPressure &pressure) const;
      std::vector<Complex> effect_of_pressure(const ContactPressure &other,
                                              const SurfaceVectors<dim> &x_vectors,
                                              const SurfaceVectors<dim> &z_vectors) const;
      /// Multiplies what moves eigenvalues like a change of the stiffness: a column a mode.
      void add_answer_of_damping(std::vector<Complex> &effects) const;
      Kind kind_of(const std::vector<CellIterator> &cells) const;
      std::vector<std::vector<Complex>> parts_by_kind();
      void find_corrections(EigenvalueErrors &errors);
      std::vector<BarPart> parts_by_body(const EigenvalueErrors &errors) const;
      std::vector<BarPart> parts_by_contact() const;

      const BrakeModel<dim> &model;
      const EigenPairs &modes;
      const unsigned int m; ///< modes
      EnrichedResiduals<dim> residuals;
      const EnrichedSpace<dim> &space; ///< theirs
      LocalProblems<dim> local;
      std::unique_ptr<ElementProblems> elements; ///< if some keep own polynomials
      std::vector<std::vector<double>> element_shares;
      YieldingBodies<dim> yielding_bodies;
      std::vector<Column> answers_of_bodies;        ///< to [Re X, Im X] of the modes
      std::vector<Column> sums;                     ///< of resistances, while these are shared
      std::unique_ptr<YieldingCells<dim>> yielding; ///< if some body may lock
      std::vector<bool> locks;                      ///< by material
      std::vector<double> proportions;              ///< by material, viscous_proportion()
      std::vector<std::vector<double>> shares;      ///< s_K of each cell's unknowns
      ComplexDenseMatrix t;                         ///< T
      std::map<Kind, std::vector<Complex>> kinds;   ///< parts of F by kinds of cells, of this rank
      ComplexDenseMatrix more_yielding;     ///< what T becomes more where V_h follows, at most
      std::vector<Column> state_correction; ///< sums and numbers of summands
      /// What the edge of each contact changes at most (EdgeEffects::by_interface).
      std::map<unsigned int, std::vector<Complex>> edges_by_interface;
    };

    template <int dim>
    Estimator<dim>::Estimator(const BrakeModel<dim> &model, const EigenPairs &modes)
        : model(model), modes(modes), m(modes.size()), residuals(model, modes),
          space(residuals.space), local(space.fine, space.map, residuals.cells,
                                        residuals.contact.get(), model.parameters().pads.pressure,
                                        model.parameters().terms().friction, model.ties().scale),
          yielding_bodies(residuals, shift_of(modes)), t(m, m), more_yielding(m, m),
          state_correction(space.map.zeros(2))
    {
      if constexpr (dim == 3)
        if (!space.base.geometry.own.empty())
          elements = std::make_unique<ElementProblems>(space, residuals.cells, local);
      const unsigned int degree = space.base.fe.degree;
      for (const Parameters::BodyMaterial &material : residuals.materials)
      {
        locks.push_back(may_lock(material.material, degree));
        proportions.push_back(viscous_proportion<dim>(material.material));
      }
    }

    template <int dim>
    void Estimator<dim>::add_products()
    {
      // By pieces that stay in the cache: copies of all columns would be large.
      constexpr unsigned int longest = 1024;
      DenseMatrix products(2 * residuals.n_vectors, 2 * residuals.n_vectors), z, r;
      for (unsigned int first = 0; first < residuals.lifted.n_local(); first += longest)
      {
        const unsigned int n_rows = std::min(longest, residuals.lifted.n_local() - first);
        if (z.n_rows != n_rows)
          z = r = DenseMatrix(n_rows, 2 * residuals.n_vectors);
        for (unsigned int j = 0; j < 2 * residuals.n_vectors; ++j)
        {
          std::copy_n(residuals.lifted.column(2 * residuals.n_vectors + j) + first, n_rows,
                      z.column(j));
          std::copy_n(residuals.values[j].begin() + first, n_rows, r.column(j));
        }
        add_product(1, z.transpose(), r, products);
      }
      t += adjoint_product(products).columns(0, m).rows(0, m);
    }

    /// Residuals of faces and edges are divided among the cells that share them, in proportion to
    /// the stiffness k_K with which each resists there (LocalProblems::resistance), so that a soft
    /// cell does not answer alone to what its stiff neighbour holds: with s_K = k_K / sum k the
    /// local energies s_K^2 r^2 / k_K sum to r^2 / sum k. Where finer cells hang on a face they
    /// resist, too, but have no local problem there: s_K = k_K / sqrt(sum k (sum k + k_hanging)).
    template <int dim>
    void Estimator<dim>::share_faces()
    {
      // Sums over the cells that have a local problem; sums and numbers of those that hang
      sums                = space.map.zeros(3);
      unsigned int number = 0;
      for (const auto &cell : space.fine.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          const Material &material = residuals.materials[residuals.material_of(cell)].material;
          shares.emplace_back();
          if (is_part(cell))
          {
            ++number;
            continue;
          }
          residuals.cells.reinit(cell);
          shares.back() = local.resistance(material, residuals.cells);
          for (const auto &entry : space.map.cells[number])
            if (entry.direct)
              sums[0].local_element(entry.index) += shares[number][entry.unknown];
            else
            {
              sums[1].local_element(entry.index) += shares[number][entry.unknown];
              sums[2].local_element(entry.index) += 1;
            }
          ++number;
        }
      element_shares.resize(space.map.elements.size());
      if constexpr (dim == 3)
        for (unsigned int e = 0; elements && e < space.map.elements.size(); ++e)
        {
          const ElementProblems::Element &element = space.map.elements[e];
          if (!element.mine)
            continue;
          const unsigned int material = residuals.material_of(element.cells.cells[0]);
          element_shares[e] = elements->resistance(element, residuals.materials[material].material);
          for (unsigned int i = 0; i < element.unknowns.size(); ++i)
            sums[0].local_element(element.unknowns[i].index) += element_shares[e][i];
        }
      for (Column &sum : sums)
      {
        sum.compress(VectorOperation::add);
        sum.update_ghost_values();
      }
      const SecondSides<dim> second_sides(space.fine, residuals.contact.get(), shares);
      for (unsigned int cell = 0; cell < space.map.cells.size(); ++cell)
        for (const auto &entry : space.map.cells[cell])
          if (entry.direct && !shares[cell].empty())
            shares[cell][entry.unknown] = share(entry.index, shares[cell][entry.unknown]);
      if constexpr (dim == 3)
        for (unsigned int e = 0; elements && e < space.map.elements.size(); ++e)
          for (unsigned int i = 0; i < element_shares[e].size(); ++i)
            element_shares[e][i] =
                share(space.map.elements[e].unknowns[i].index, element_shares[e][i]);
      sums.clear();
      second_sides.reduce(shares);
      for (Column &residual : residuals.values)
        residual.update_ghost_values();
    }

    template <int dim>
    double Estimator<dim>::share(const unsigned int index, const double resistance) const
    {
      const double direct = sums[0].local_element(index), count = sums[2].local_element(index),
                   // A cell of half the size resists half as much as one that fits.
          hanging = count > 0 ? 2 * sums[1].local_element(index) / count : 0;
      return resistance / std::sqrt(direct * (direct + hanging));
    }

    /// The matrix of a cell's problem if functions of V_h on it give way, too.
    template <int dim>
    DenseMatrix Estimator<dim>::soften(const unsigned int number, const unsigned int material,
                                       const LocalProblem &problem)
    {
      if (!yielding)
        yielding =
            std::make_unique<YieldingCells<dim>>(local.functions, space.lift, residuals.cells);
      std::vector<bool> movable(space.n_fields * space.base.fe.n_dofs_per_cell());
      for (const auto &entry : space.base_map.cells[number])
        movable[entry.unknown] = true;
      return yielding->soften(problem, movable, residuals.materials[material].material,
                              residuals.cells);
    }

    template <int dim>
    void Estimator<dim>::eliminate(EigenvalueErrors &errors)
    {
      const unsigned int n_w    = local.functions.n_columns,
                         n_wide = space.n_fields * 4 * residuals.n_vectors;
      DenseMatrix all(space.n, n_wide), tested(n_w, n_wide);
      errors.cells.resize(space.map.cells.size());
      unsigned int number = 0;
      for (const auto &cell : space.fine.nodes.active_cell_iterators())
      {
        if (!cell->is_locally_owned())
          continue;
        if (is_part(cell))
        {
          ++number;
          continue;
        }
        const unsigned int material = residuals.material_of(cell);
        residuals.cells.reinit(cell);
        LocalProblem problem =
            local.make(cell, number, residuals.materials[material].material, residuals.cells);
        std::fill(all.values.begin(), all.values.end(), 0.);
        for (unsigned int j = 0; j < 4 * residuals.n_vectors; ++j)
          for (const auto &entry : space.map.cells[number])
            if (entry.direct)
              all.values[std::size_t(j) * space.n_fields * space.n + entry.unknown] =
                  shares[number][entry.unknown] * residuals.values[j].local_element(entry.index);
        gemm<double>(1, local.functions.transpose(), all, 0, tested.values.data());
        const unsigned int n_kept = problem.unknowns.size();
        DenseMatrix r(n_kept, 4 * residuals.n_vectors);
        for (unsigned int j = 0; j < 4 * residuals.n_vectors; ++j)
          for (unsigned int i = 0; i < n_kept; ++i)
            r(i, j) = tested.values[std::size_t(j) * space.n_fields * n_w + problem.unknowns[i]];
        DenseMatrix softer;
        ComplexDenseMatrix of_body;
        if (yielding_bodies.has(cell))
          of_body = answer_of_body(places_of_cell(number));
        else if (locks[material] || yielding_bodies.had(cell) ||
                 is_long_at_support<dim>(cell, space.base.geometry.supports))
          softer = soften(number, material, problem);
        const DenseMatrix solution = add_answer(problem, r, std::move(softer), of_body, material,
                                                kind_of({cell}), errors.cells[number]);
        if (residuals.with_state)
          add_state_correction(local.functions, number, problem.unknowns,
                               &solution.values[n_kept * m]);
        ++number;
      }
      eliminate_elements(errors);
      for (std::vector<std::complex<float>> &parts : errors.cells)
        parts.resize(m); // an element's are its first cell's
    }

    /// Eliminates the local problems of elements with own polynomials.
    template <int dim>
    void Estimator<dim>::eliminate_elements(EigenvalueErrors &errors)
    {
      if constexpr (dim == 3)
        for (unsigned int e = 0; elements && e < space.map.elements.size(); ++e)
        {
          const ElementProblems::Element &element = space.map.elements[e];
          if (!element.mine)
            continue;
          const unsigned int material = residuals.material_of(element.cells.cells[0]),
                             n_f      = elements->n_functions(element.shape),
                             n        = element.unknowns.size();
          LocalProblem problem = elements->make(element, residuals.materials[material].material);
          // Values of the problem's functions at the element's unknowns; residuals there
          const unsigned int n_kept = problem.unknowns.size();
          DenseMatrix values(n, n_kept), there(n, 4 * residuals.n_vectors);
          for (unsigned int i = 0; i < n; ++i)
          {
            const auto &unknown         = element.unknowns[i];
            const DenseMatrix &of_field = elements->values(element.shape, unknown.field);
            for (unsigned int k = 0; k < n_kept; ++k)
              if (problem.unknowns[k] / n_f == unknown.field)
                values(i, k) = of_field(unknown.node, problem.unknowns[k] % n_f);
            for (unsigned int j = 0; j < 4 * residuals.n_vectors; ++j)
              there(i, j) = element_shares[e][i] * residuals.values[j].local_element(unknown.index);
          }
          const DenseMatrix r = values.transpose() * there;
          DenseMatrix softer;
          ComplexDenseMatrix of_body;
          const auto &cells = element.cells.cells;
          if (yielding_bodies.has(cells[0]))
            of_body = answer_of_body(places_of_element(e));
          else if (locks[material] || yielding_bodies.had(cells[0]) ||
                   std::any_of(cells.begin(), cells.end(),
                               [&](const CellIterator &cell) {
                                 return is_long_at_support<3>(cell, space.base.geometry.supports);
                               }))
            softer = elements->soften(element, problem, residuals.materials[material].material);
          const DenseMatrix solution = add_answer(problem, r, std::move(softer), of_body, material,
                                                  kind_of(cells), errors.cells[element.number]);
          for (unsigned int i = 0; i < n && residuals.with_state; ++i)
          {
            double sum = 0;
            for (unsigned int k = 0; k < n_kept; ++k)
              sum += values(i, k) * solution(k, m);
            state_correction[0].local_element(element.unknowns[i].index) += sum;
            state_correction[1].local_element(element.unknowns[i].index) += 1;
          }
        }
    }

    /// Adds what the local problem answers to its residuals [right, left] to T and to the parts of
    /// its kind; with a @p softer matrix what more it gives way. Where the body yields, @p of_body
    /// is what it answers here, Z^H R^H D, and only the static state needs the local solution.
    /// Returns that for the right ones.
    template <int dim>
    DenseMatrix Estimator<dim>::add_answer(LocalProblem &problem, const DenseMatrix &r,
                                           DenseMatrix softer, const ComplexDenseMatrix &of_body,
                                           const unsigned int material, const Kind &kind,
                                           std::vector<std::complex<float>> &parts)
    {
      const bool yields             = !softer.values.empty();
      const unsigned int n_half     = 2 * residuals.n_vectors;
      const DenseView<double> right = r.columns(0, n_half), left = r.columns(n_half, n_half);
      DenseMatrix solution;
      if (of_body.empty() || residuals.with_state)
        solution = problem.symmetric ? solve_positive(std::move(problem.matrix), right)
                                     : solve(std::move(problem.matrix), right);
      const ComplexDenseMatrix answer =
          of_body.empty() ? adjoint_product(left.transpose() * solution) : of_body;
      ComplexDenseMatrix softer_answer;
      if (yields)
        softer_answer = adjoint_product(
            left.transpose() * (problem.symmetric ? solve_positive(std::move(softer), right)
                                                  : solve(std::move(softer), right)));
      std::vector<Complex> &of_kind = kinds[kind];
      of_kind.resize(m * m);
      for (unsigned int j = 0; j < m; ++j)
        for (unsigned int i = 0; i < m; ++i)
        {
          // Damping makes the stiffness complex.
          const OperatorFactors &c = residuals.factors[material][j];
          const Complex stiffness  = c.k + c.v * proportions[material];
          const Complex e          = answer(i, j) / stiffness;
          t(i, j) -= e;
          of_kind[i + m * j] += e / (2. * modes.lambda[i]);
          if (yields)
            more_yielding(i, j) -= softer_answer(i, j) / stiffness - e;
          if (i == j)
            parts.emplace_back(e / (2. * modes.lambda[j]));
        }
      return solution;
    }

    template <int dim>
    typename Estimator<dim>::Places Estimator<dim>::places_of_cell(const unsigned int number) const
    {
      Places places;
      for (const auto &entry : space.map.cells[number])
        if (entry.direct && entry.unknown < dim * space.n)
          places.emplace_back(entry.index, shares[number][entry.unknown]);
      return places;
    }

    template <int dim>
    typename Estimator<dim>::Places Estimator<dim>::places_of_element(const unsigned int e) const
    {
      const auto &unknowns = space.map.elements[e].unknowns;
      Places places;
      for (unsigned int i = 0; i < unknowns.size(); ++i)
        if (unknowns[i].field < dim)
          places.emplace_back(unknowns[i].index, element_shares[e][i]);
      return places;
    }

    /// Solves for what yielding bodies answer to the right vectors' residuals.
    template <int dim>
    void Estimator<dim>::find_answers_of_bodies()
    {
      if (yielding_bodies.empty())
        return;
      std::vector<Places> parts;
      unsigned int number = 0;
      for (const auto &cell : space.fine.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          if (yielding_bodies.has(cell) && !is_part(cell))
            parts.push_back(places_of_cell(number));
          ++number;
        }
      for (unsigned int e = 0; e < space.map.elements.size(); ++e)
        if (const auto &element = space.map.elements[e];
            element.mine && yielding_bodies.has(element.cells.cells[0]))
          parts.push_back(places_of_element(e));
      MultiVector block(space.fine.rows, 2 * m);
      for (unsigned int j = 0; j < 2 * m; ++j)
      {
        const Column &residual = residuals.values[j / m * residuals.n_vectors + j % m];
        Column sum             = space.map.zeros(1)[0];
        for (const Places &places : parts)
          for (const auto &[index, share] : places)
            sum.local_element(index) += share * residual.local_element(index);
        sum.compress(VectorOperation::add);
        std::copy_n(sum.begin(), block.n_local(), block.column(j));
      }
      try
      {
        answers_of_bodies = space.map.import(yielding_bodies.answer(block));
      }
      catch (const SolverError &) // most likely no memory: bars by softer local problems are long
      {
        yielding_bodies.give_up();
      }
    }

    /// Z^H R^H D on some places.
    template <int dim>
    ComplexDenseMatrix Estimator<dim>::answer_of_body(const Places &places) const
    {
      DenseMatrix left(places.size(), 2 * residuals.n_vectors), answers = left;
      for (unsigned int j = 0; j < 2 * m; ++j)
      {
        const unsigned int column = j / m * residuals.n_vectors + j % m;
        const Column &residual    = residuals.values[2 * residuals.n_vectors + column];
        for (unsigned int i = 0; i < places.size(); ++i)
        {
          const auto &[index, share] = places[i];
          left(i, column)            = share * residual.local_element(index);
          answers(i, column)         = answers_of_bodies[j].local_element(index);
        }
      }
      return adjoint_product(left.transpose() * answers);
    }

    /// What a cell's problem adds to the static state. Functions on faces appear in each cell's
    /// problem, with its share of the residual: their mean counts.
    template <int dim>
    void
    Estimator<dim>::add_state_correction(const DenseMatrix &functions, const unsigned int number,
                                         const std::vector<int> &unknowns, const double *solution)
    {
      const unsigned int n_w = functions.n_columns;
      std::vector<double> values(space.n_fields * space.n);
      for (unsigned int r = 0; r < unknowns.size(); ++r)
        for (unsigned int a = 0; a < space.n; ++a)
          values[unknowns[r] / n_w * space.n + a] += functions(a, unknowns[r] % n_w) * solution[r];
      for (const auto &entry : space.map.cells[number])
        if (entry.direct)
        {
          state_correction[0].local_element(entry.index) += values[entry.unknown];
          state_correction[1].local_element(entry.index) += 1;
        }
    }

    /// Adds the effect of the steady pressure's own error.
    ///
    /// Its error with the answer of V_h is found at the present contacts. Where that leaves tension
    /// contacts would open, and it says nothing: then twice the effect of the local problems alone
    /// is a bound, the two for the answer of V_h.
    template <int dim>
    void Estimator<dim>::add_effect_of_pressure(ErrorEffects &effects)
    {
      // -B r_0 of the state's residual; functions of several cells have several values
      MultiVector local(space.fine.rows, 1);
      state_correction[0].compress(VectorOperation::add);
      state_correction[1].compress(VectorOperation::add);
      for (unsigned int i = 0; i < local.n_local(); ++i)
        if (const double count = state_correction[1].local_element(i); count > 0)
          local.data()[i] = -state_correction[0].local_element(i) / count;
      const MultiVector state = residuals.lifted.columns(m, 1);
      const SurfaceVectors<dim> x_vectors(*residuals.contact, residuals.lifted, 0,
                                          2 * residuals.n_vectors),
          z_vectors(*residuals.contact, residuals.lifted, 2 * residuals.n_vectors,
                    2 * residuals.n_vectors);
      residuals.close_at_edge();
      // Surfaces are all that is needed from here on: room for factors.
      residuals.values.clear();
      residuals.lifted         = MultiVector();
      const auto pressure_with = [&](MultiVector change)
      {
        change += state;
        return residuals.contact->pressure_of(change);
      };
      try
      {
        constexpr double most_tension = 0.05; // of the normal force
        const ContactPressure with_answer =
            pressure_with(static_correction(model, residuals, local));
        if (share_of_tension(with_answer) <= most_tension)
        {
          const std::vector<Complex> effect = effect_of_pressure(with_answer, x_vectors, z_vectors);
          for (unsigned int k = 0; k < m * m; ++k)
            effects.f[k] += effect[k];
          return;
        }
      }
      catch (const SingularMatrix &)
      {
        // The contact holds what would move freely beside a rotor at rest: no answer either.
      }
      local *= 2;
      effects.alternatives.push_back(
          {{effect_of_pressure(pressure_with(std::move(local)), x_vectors, z_vectors)},
           false,
           "steady pressure"});
    }

    /// int max(-p, 0) by int |p| of the steady pressure, on all that slides.
    template <int dim>
    double Estimator<dim>::share_of_tension(const ContactPressure &pressure) const
    {
      double sums[2] = {0, 0};
      residuals.contact->for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            for (unsigned int q = 0; q < k.n_points; ++q)
            {
              sums[0] += k.weights[q] * std::max(0., -pressure[i][k.first_point + q]);
              sums[1] += k.weights[q] * std::abs(residuals.pressure[i][k.first_point + q]);
            }
          });
      MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, space.fine.comm);
      return sums[1] > 0 ? sums[0] / sums[1] : 0;
    }

    /// First-order changes of the eigenvalues, like F, by another steady pressure:
    ///     -z_i^H (dQ + l_j dP) x_j / (2 l_i),
    /// dP and dQ the friction damping of what it differs by.
    template <int dim>
    std::vector<Complex>
    Estimator<dim>::effect_of_pressure(const ContactPressure &other,
                                       const SurfaceVectors<dim> &x_vectors,
                                       const SurfaceVectors<dim> &z_vectors) const
    {
      // [Re Z, Im Z]^T dP [Re X, Im X] and the same of dQ, by order
      std::array<DenseMatrix, 2> forms;
      for (DenseMatrix &form : forms)
        form = DenseMatrix(2 * residuals.n_vectors, 2 * residuals.n_vectors);
      residuals.contact->for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            const std::vector<ContactProduct> before = damping_products(*residuals.contact, i, k,
                                                                        residuals.pressure),
                                              after =
                                                  damping_products(*residuals.contact, i, k, other);
            for (unsigned int p = 0; p < before.size(); ++p)
            {
              std::vector<double> change = after[p].c;
              for (unsigned int q = 0; q < k.n_points; ++q)
                change[q] -= before[p].c[q];
              const DenseMatrix z = z_vectors.traces(before[p].left, k);
              DenseMatrix x       = x_vectors.traces(before[p].right, k);
              x.scale(change);
              add_product(1, z, x.transpose(), forms[before[p].order]);
            }
          });
      std::vector<Complex> f(m * m);
      for (unsigned int order = 0; order < 2; ++order)
      {
        DenseMatrix &form = forms[order];
        MPI_Allreduce(MPI_IN_PLACE, form.values.data(), form.values.size(), MPI_DOUBLE, MPI_SUM,
                      space.fine.comm);
        const ComplexDenseMatrix product = adjoint_product(form);
        for (unsigned int i = 0; i < m; ++i)
          for (unsigned int j = 0; j < m; ++j)
            f[i + m * j] -=
                (order == 0 ? 1. : modes.lambda[j]) * product(i, j) / (2. * modes.lambda[i]);
      }
      return f;
    }

    /// Damping by measured ratios follows the real modes: P = g(M^{-1} K) in their coordinates with
    /// g(w^2) = 2 zeta(w) w, so that with K it changes by g' dK, between modes of one frequency:
    ///     dK + l dP = (1 + l g') dK,   g' = (w zeta(w))' / w.
    template <int dim>
    void Estimator<dim>::add_answer_of_damping(std::vector<Complex> &effects) const
    {
      for (const RelaxationTerm &term : model.relaxation())
        if (term.low_rank)
          for (unsigned int j = 0; j < m; ++j)
          {
            const Complex l    = modes.lambda[j];
            const double omega = std::abs(l);
            const Complex answer =
                1. + l * model.parameters().modal_damping.slope(omega / (2 * M_PI)) / omega;
            for (unsigned int i = 0; i < m && !effects.empty(); ++i)
              effects[i + m * j] *= answer;
          }
    }

    /// The kind of a cell, or of an element's cells: the boundaries at which they lie, and their
    /// material.
    template <int dim>
    typename Estimator<dim>::Kind
    Estimator<dim>::kind_of(const std::vector<CellIterator> &cells) const
    {
      Kind kind;
      for (const CellIterator &cell : cells)
        for (const unsigned int face : cell->face_indices())
          if (cell->face(face)->at_boundary())
            kind.push_back(cell->face(face)->boundary_id());
      std::sort(kind.begin(), kind.end());
      if (cells.size() > 1)
        kind.erase(std::unique(kind.begin(), kind.end()), kind.end());
      kind.push_back(residuals.material_of(cells[0]));
      return kind;
    }

    /// The parts of F by kinds of cells, of all ranks. Collective.
    template <int dim>
    std::vector<std::vector<Complex>> Estimator<dim>::parts_by_kind()
    {
      std::vector<Kind> here;
      for (const auto &[kind, part] : kinds)
        here.push_back(kind);
      for (const std::vector<Kind> &of_rank : Utilities::MPI::all_gather(space.fine.comm, here))
        for (const Kind &kind : of_rank)
          kinds[kind].resize(m * m);
      std::vector<std::vector<Complex>> parts;
      for (auto &[kind, part] : kinds)
      {
        MPI_Allreduce(MPI_IN_PLACE, part.data(), m * m, MPI_CXX_DOUBLE_COMPLEX, MPI_SUM,
                      space.fine.comm);
        add_answer_of_damping(part);
        parts.push_back(std::move(part));
      }
      kinds.clear();
      return parts;
    }

    /// Corrections and bounds out of T, summed over all ranks.
    template <int dim>
    void Estimator<dim>::find_corrections(EigenvalueErrors &errors)
    {
      for (ComplexDenseMatrix *block : {&t, &more_yielding})
      {
        MPI_Allreduce(MPI_IN_PLACE, block->values.data(), m * m, MPI_CXX_DOUBLE_COMPLEX, MPI_SUM,
                      space.fine.comm);
        for (unsigned int j = 0; j < m; ++j)
          for (unsigned int i = 0; i < m; ++i)
            (*block)(i, j) /= -2. * modes.lambda[i];
        add_answer_of_damping(block->values);
      }
      const std::vector<Complex> &yielding_effect = more_yielding.values;
      ErrorEffects &effects                       = errors.effects;
      effects = {std::move(t.values), parts_by_kind(), space.base.fe.degree, {}};
      if (residuals.with_state)
        add_effect_of_pressure(effects);
      const std::vector<BarPart> of_bodies = parts_by_body(errors);
      for (ErrorEffects::Alternatives &edges : other_edges(errors))
      {
        for (std::vector<Complex> &edge : edges.effects)
          add_answer_of_damping(edge);
        effects.alternatives.push_back(std::move(edges));
      }
      // The same on all ranks, whichever has such cells
      if (std::any_of(yielding_effect.begin(), yielding_effect.end(),
                      [](const Complex e) { return e != 0.; }))
        effects.alternatives.push_back({{yielding_effect}, false, "locking"});
      errors.bounds = bound_errors(modes.lambda, modes.parity, effects);
      for (const std::vector<BarPart> &parts : {of_bodies, parts_by_contact()})
        errors.bounds.parts.insert(errors.bounds.parts.end(), parts.begin(), parts.end());
    }

    /// What one degree more may change by the cells of each body alone, without coupling of modes.
    /// Call it before cells get parts of the edge of contact. Collective.
    template <int dim>
    std::vector<BarPart> Estimator<dim>::parts_by_body(const EigenvalueErrors &errors) const
    {
      const Geometry<dim> &geometry = space.base.geometry;
      std::vector<std::pair<std::string, Body>> bodies;
      for (const auto &[name, body] : geometry.named_bodies())
        bodies.emplace_back(name, body);
      std::vector<Complex> sums(bodies.size() * m);
      unsigned int number = 0;
      for (const auto &cell : space.base.triangulation.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          const Body body = geometry.parts[cell->material_id()].body;
          const std::size_t b =
              std::find_if(bodies.begin(), bodies.end(),
                           [&](const auto &named) { return named.second == body; }) -
              bodies.begin();
          for (unsigned int j = 0; j < m && b < bodies.size(); ++j)
            sums[b * m + j] += errors.cells[number][j];
          ++number;
        }
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_CXX_DOUBLE_COMPLEX, MPI_SUM,
                    space.fine.comm);
      const double whole = whole_effect(space.base.fe.degree);
      std::vector<BarPart> parts;
      for (std::size_t b = 0; b < bodies.size(); ++b)
      {
        parts.push_back({"one degree more", bodies[b].first, {}, {}});
        for (unsigned int j = 0; j < m; ++j)
          parts.back().add(whole * sums[b * m + j]);
      }
      return parts;
    }

    /// What the edge of each contact alone may change.
    template <int dim>
    std::vector<BarPart> Estimator<dim>::parts_by_contact() const
    {
      std::vector<BarPart> parts;
      for (const auto &[interface, change] : edges_by_interface)
      {
        parts.push_back(
            {"edge of contact", model.contact()->paired_interfaces()[interface].name, {}, {}});
        for (unsigned int j = 0; j < m; ++j)
          parts.back().add(change[j] / (-2. * modes.lambda[j]));
      }
      return parts;
    }

    /// Changes of the eigenvalues by another edge of the contact zone, like F: of pads to first
    /// order, level by level of their cells, so that what one says of another is little; of joints
    /// by small problems. Their parts go to the cells that share the edge's nodes.
    template <int dim>
    std::vector<ErrorEffects::Alternatives> Estimator<dim>::other_edges(EigenvalueErrors &errors)
    {
      if (!model.equilibrium())
        return {};
      const ContactEdge &edge                           = model.equilibrium()->edge;
      std::vector<ErrorEffects::Alternatives> of_joints = edges_of_joints();
      EdgeEffects effects = of_joints.empty() ? edge_effects(edge, modes.right, modes.left)
                                              : edge_effects(sliding_edge(edge, *model.contact()),
                                                             modes.right, modes.left);
      if (effects.rows.empty())
        return of_joints;
      for (const auto &[interface, change] : effects.by_interface)
        if (of_joints.empty() || model.contact()->slides(interface))
          edges_by_interface[interface] = change;
      std::vector<ErrorEffects::Alternatives> alternatives;
      for (EdgeEffects::Shifts &shifts : effects.by_level)
      {
        const std::string level =
            effects.by_level.size() > 1 ? text_of(" of level ", alternatives.size()) : "";
        alternatives.push_back(
            {{std::move(shifts.smaller), std::move(shifts.larger), std::move(shifts.likeliest)},
             true,
             "edge of contact" + level});
        for (std::vector<Complex> &products : alternatives.back().effects)
          for (unsigned int k = 0; k < m * m; ++k)
            products[k] /= -2. * modes.lambda[k % m];
      }

      for (ErrorEffects::Alternatives &group : of_joints)
        alternatives.push_back(std::move(group));

      // What small problems say of a joint's edge is divided among its rows.
      const auto divide = [&](const std::vector<unsigned int> &part_of_row, const unsigned int from)
      {
        for (unsigned int i = 0; i < part_of_row.size() && !of_joints.empty(); ++i)
        {
          const auto in_part = [&](const unsigned int interface)
          {
            return std::count_if(part_of_row.begin(), part_of_row.end(),
                                 [&](const unsigned int p)
                                 { return edge.parts[p].interface == interface; });
          };
          const unsigned int interface = edge.parts[part_of_row[i]].interface;
          if (!model.contact()->slides(interface))
            for (unsigned int j = 0; j < m; ++j)
              effects.parts[from + i][j] =
                  edges_by_interface[interface][j] / double(in_part(interface));
        }
      };
      divide(edge.releasing_at, 0);
      divide(edge.closing_at, edge.releasing.size());

      // By row: its number in the list plus one
      std::vector<Column> places = space.base_map.zeros(1);
      for (unsigned int i = 0; i < effects.rows.size(); ++i)
        if (space.base.rows.contains(effects.rows[i]))
          places[0].local_element(effects.rows[i] - space.base.rows.begin) = i + 1;
      places[0].update_ghost_values();
      for (unsigned int cell = 0; cell < errors.cells.size(); ++cell)
        for (const auto &entry : space.base_map.cells[cell])
          if (const unsigned int place = places[0].local_element(entry.index); place > 0)
            for (unsigned int j = 0; j < m; ++j)
              errors.cells[cell][j] += effects.parts[place - 1][j] / (2. * modes.lambda[j]);
      return alternatives;
    }

    /// Other edges of contacts between bodies that do not slide, by small problems: within half a
    /// spacing on either side, a group for each. In a brake that is its own mirror image all change
    /// together. Empty where there are none, and where the position terms have no factors: then
    /// first order must do.
    template <int dim>
    std::vector<ErrorEffects::Alternatives> Estimator<dim>::edges_of_joints()
    {
      std::vector<ChangedEdge> edges;
      try
      {
        edges = changed_edges(model.equilibrium()->edge, *model.contact(),
                              model.equilibrium()->state, model.equations(), modes);
      }
      catch (const SolverError &)
      {
        return {};
      }
      std::vector<ErrorEffects::Alternatives> groups;
      for (const ChangedEdge &edge : edges)
      {
        if (groups.empty() || modes.parity.empty())
          groups.push_back(
              {std::vector<std::vector<Complex>>(3, std::vector<Complex>(m * m)), true,
               modes.parity.empty()
                   ? "edge of " + model.contact()->paired_interfaces()[edge.interface].name
                   : "edge of contact joints"});
        std::vector<std::vector<Complex>> &F = groups.back().effects; // smaller, larger, likeliest
        std::vector<Complex> &here           = edges_by_interface[edge.interface];
        here.resize(m);
        for (std::size_t k = 0; k < std::size_t(m) * m; ++k)
        {
          // F(s) = (s^2 - s)/2 F_o + (s^2 + s)/2 F_c at s = -1/2 and 1/2
          const Complex smaller = 0.375 * edge.opening[k] - 0.125 * edge.closing[k],
                        larger  = 0.375 * edge.closing[k] - 0.125 * edge.opening[k];
          F[0][k] += smaller;
          F[1][k] += larger;
          if (k % (m + 1) == 0)
            here[k / (m + 1)] = -2. * modes.lambda[k / (m + 1)] *
                                (std::abs(smaller) > std::abs(larger) ? smaller : larger);
        }
      }
      return groups;
    }

    template <int dim>
    EigenvalueErrors Estimator<dim>::run()
    {
      EigenvalueErrors errors;
      add_products();
      share_faces();
      find_answers_of_bodies();
      eliminate(errors);
      find_corrections(errors);
      return errors;
    }
  } // namespace

  template <int dim>
  EigenvalueErrors estimate_errors(const BrakeModel<dim> &model, const EigenPairs &modes)
  {
    return modes.empty() ? EigenvalueErrors() : Estimator<dim>(model, modes).run();
  }

  template EigenvalueErrors estimate_errors<2>(const BrakeModel<2> &, const EigenPairs &);
  template EigenvalueErrors estimate_errors<3>(const BrakeModel<3> &, const EigenPairs &);
} // namespace squeal

#include <squeal/assessment/cell_residuals.h>
#include <squeal/assessment/error_estimators.h>
#include <squeal/assessment/local_problems.h>
#include <squeal/assessment/locking.h>
#include <squeal/assessment/second_sides.h>
#include <squeal/assessment/stability.h>
#include <squeal/assessment/surface_vectors.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/mesh/cell_map.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

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

    /// Sums of a body's terms at the eigenvalue l: sum c l^order for each kind of matrix, and what
    /// f(l) makes of the stiffness. The static stress has one, if there is any.
    OperatorFactors factors_at(const Parameters::All &prm, const Parameters::BodyMaterial &material,
                               const Complex l, const bool has_stress)
    {
      std::array<Complex, 5> sums{};
      if (prm.terms().material_damping)
        sums[static_cast<unsigned int>(BodyTerm::Kind::K)] =
            material.material.stiffness_factor(l) - 1.;
      for (const BodyTerm &term : body_terms(prm, material))
        sums[static_cast<unsigned int>(term.matrix)] +=
            term.coefficient * (term.order == 0   ? 1.
                                : term.order == 1 ? l
                                                  : l * l);
      const auto of = [&](const BodyTerm::Kind kind)
      { return sums[static_cast<unsigned int>(kind)]; };
      return {of(BodyTerm::Kind::M),      of(BodyTerm::Kind::K), of(BodyTerm::Kind::G),
              of(BodyTerm::Kind::M_star), has_stress ? 1. : 0.,  of(BodyTerm::Kind::V)};
    }

    template <int dim>
    class Estimator
    {
    public:
      Estimator(const BrakeModel<dim> &model, const EigenPairs &modes);
      EigenvalueErrors run();

    private:
      std::vector<Column> import_columns() const;
      MultiVector interpolate(const MultiVector &column);
      void release_at_edge();
      void pair_contact();
      /// The functions of a cell in the space of one degree more: n rows, the dim components of a
      /// column side by side, then the other fields of all. They also go to @p result.
      void lift_cell(unsigned int number, const std::vector<Column> &columns, DenseMatrix &coarse,
                     MultiVector &result);
      /// Lifts columns and adds the products of the bodies' operators with them to @p forces: the
      /// columns [Re X, Im X, Re Z, Im Z], as many of each as a material has factors.
      void add_bodies(const std::vector<Column> &columns,
                      const std::vector<std::vector<OperatorFactors>> &by_material,
                      MultiVector &in_fine_space, std::vector<Column> &forces);
      void add_measured_damping();
      void add_contact();
      /// Adds what is there as matrices, that is little.
      void add_matrices();
      void share_faces();
      /// Adds Z^H Q+ X to T.
      void add_products();
      void eliminate(EigenvalueErrors &errors);
      DenseMatrix soften(unsigned int number, unsigned int material, const LocalProblem &problem);
      std::vector<std::vector<Complex>> other_edges(EigenvalueErrors &errors) const;
      void add_state_correction(const DenseMatrix &functions, unsigned int number,
                                const std::vector<int> &unknowns, const double *solution);
      void add_static_residual();
      std::vector<Complex> other_pressure();
      /// Multiplies what moves eigenvalues like a change of the stiffness: a column a mode.
      void add_answer_of_damping(std::vector<Complex> &effects) const;
      void find_corrections(EigenvalueErrors &errors);
      /// Whether the body has a geometric stiffness, as in BrakeModel::linearise().
      bool is_stressed(const Parameters::BodyMaterial &material) const
      {
        return model.equilibrium() && prm.prestress.needs_state() &&
               (material.of_rotor || prm.prestress.stress_stiffness);
      }
      unsigned int material_of(const typename DoFHandler<dim>::active_cell_iterator &cell) const
      {
        return base.geometry.parts[cell->material_id()].material;
      }

      const BrakeModel<dim> &model;
      const Parameters::All &prm;
      const EigenPairs &modes;
      const unsigned int m; ///< modes
      /// Whether the eigenvalues depend on the steady pressure, so that its error is wanted: then
      /// the static state goes through the same local problems as one more vector.
      const bool with_state;
      const unsigned int n_vectors;        ///< modes and state
      const FiniteElementSpace<dim> &base; ///< of the modes
      FiniteElementSpace<dim> spaces;      ///< of one degree more
      std::unique_ptr<Contact<dim>> contact;
      ContactPressure pressure;
      std::vector<Term> joint_terms, turning_terms;

      const unsigned int n;        ///< nodes of a cell, degree p + 1
      const unsigned int n_fields; ///< of a node
      const DenseMatrix lift;
      CellResiduals<dim> cell_residuals;
      std::unique_ptr<CellMap<dim>> base_map, map;
      std::unique_ptr<LocalProblems<dim>> local;
      std::unique_ptr<YieldingCells<dim>> yielding; ///< if some body may lock
      std::vector<bool> locks;                      ///< by material
      std::vector<std::vector<double>> shares;      ///< s_K of each cell's unknowns
      MultiVector lifted;                           ///< the columns, interpolated
      std::vector<Column> residuals;                ///< of the columns
      const std::vector<Parameters::BodyMaterial> materials;
      std::vector<double> proportions; ///< by material, viscous_proportion()
      /// By material: the factors of its matrices at each eigenvalue.
      std::vector<std::vector<OperatorFactors>> factors;
      DenseMatrix t_re, t_im;               ///< T
      DenseMatrix yielding_re, yielding_im; ///< what T becomes more where V_h follows, at most
      std::vector<Column> state_correction; ///< sums and numbers of summands
    };

    template <int dim>
    Estimator<dim>::Estimator(const BrakeModel<dim> &model, const EigenPairs &modes)
        : model(model), prm(model.parameters()), modes(modes), m(modes.lambda.size()),
          with_state(model.equilibrium() && model.contact() && prm.terms().friction_damping),
          n_vectors(m + with_state), base(model.spaces()), spaces(base, base.fe.degree + 1),
          n(spaces.fe.n_dofs_per_cell()), n_fields(base.n_fields()),
          lift(interpolation(base.fe, spaces.fe)), cell_residuals(base, spaces),
          materials(prm.materials()), t_re(m, m), t_im(m, m), yielding_re(m, m), yielding_im(m, m)
    {
      const bool long_cells = base.fe.degree < free_of_locking && too_long_cells(prm) > 0;
      for (const Parameters::BodyMaterial &material : materials)
      {
        locks.push_back(may_lock(material.material, base.fe.degree) ||
                        (material.of_rotor && long_cells));
        proportions.push_back(viscous_proportion<dim>(material.material));
        factors.emplace_back();
        for (const Complex &l : modes.lambda)
          factors.back().push_back(factors_at(prm, material, l, is_stressed(material)));
        if (with_state)
          factors.back().push_back(factors_at(prm, material, 0, false));
      }
    }

    /// Z^H R of two blocks of columns [Re, Im], added.
    void add_product(const DenseMatrix &z, const DenseMatrix &r, DenseMatrix &re, DenseMatrix &im)
    {
      const unsigned int m = re.n_rows;
      DenseMatrix products(2 * m, 2 * m);
      gemm(true, 1, z, r, 0, products);
      for (unsigned int j = 0; j < m; ++j)
        for (unsigned int i = 0; i < m; ++i)
        {
          re(i, j) += products(i, j) + products(m + i, m + j);
          im(i, j) += products(i, m + j) - products(m + i, j);
        }
    }

    /// The columns 2m ... 4m (the left ones), or the first 2m.
    DenseMatrix half(const DenseMatrix &all, const bool left)
    {
      const unsigned int n_columns = all.n_columns / 2;
      const auto begin = all.values.begin() + (left ? std::size_t(n_columns) * all.n_rows : 0);
      return {all.n_rows, n_columns, {begin, begin + std::size_t(n_columns) * all.n_rows}};
    }

    template <int dim>
    void Estimator<dim>::lift_cell(const unsigned int number, const std::vector<Column> &columns,
                                   DenseMatrix &coarse, MultiVector &result)
    {
      const unsigned int n_base = base.fe.n_dofs_per_cell(), n_columns = columns.size(),
                         n_others = n_fields - dim;
      if (coarse.n_columns != n_fields * n_columns)
        coarse = DenseMatrix(n_base, n_fields * n_columns);
      // The displacements of all columns come first.
      const auto place = [&](const unsigned int field, const unsigned int column) {
        return field < dim ? column * dim + field
                           : dim * n_columns + column * n_others + field - dim;
      };
      std::fill(coarse.values.begin(), coarse.values.end(), 0.);
      for (unsigned int j = 0; j < n_columns; ++j)
        for (const auto &entry : base_map->cells[number])
          coarse(entry.unknown % n_base, place(entry.unknown / n_base, j)) +=
              entry.weight * columns[j].local_element(entry.index);
      DenseMatrix fine(n, coarse.n_columns);
      gemm(false, 1, lift, coarse, 0, fine);
      for (unsigned int j = 0; j < n_columns; ++j)
        for (const auto &entry : map->cells[number])
          if (entry.direct && entry.index < result.n_local())
            result.column(j)[entry.index] = fine(entry.unknown % n, place(entry.unknown / n, j));
    }

    /// [Re X, Im X, Re Z, Im Z] of all modes; the static state, if wanted, is the last one's Re X.
    template <int dim>
    std::vector<Column> Estimator<dim>::import_columns() const
    {
      std::vector<Column> columns = base_map->zeros(4 * n_vectors);
      const auto import           = [&](const double *values, const unsigned int j)
      { std::copy_n(values, base.rows.n_local(), columns[j].begin()); };
      const MultiVector *blocks[] = {&modes.right.re, &modes.right.im, &modes.left.re,
                                     &modes.left.im};
      for (unsigned int part = 0; part < 4; ++part)
        for (unsigned int j = 0; j < m; ++j)
          import(blocks[part]->column(j), part * n_vectors + j);
      if (with_state)
        import(model.equilibrium()->state.data(), m);
      for (Column &column : columns)
        column.update_ghost_values();
      return columns;
    }

    template <int dim>
    void Estimator<dim>::add_bodies(const std::vector<Column> &columns,
                                    const std::vector<std::vector<OperatorFactors>> &by_material,
                                    MultiVector &in_fine_space, std::vector<Column> &forces)
    {
      const unsigned int n_columns    = columns.size();
      const std::vector<Column> state = prm.prestress.needs_state() && model.equilibrium()
                                            ? base_map->import(model.equilibrium()->state)
                                            : std::vector<Column>();
      DenseMatrix u_0(n_fields * base.fe.n_dofs_per_cell(), 1), coarse,
          u(base.fe.n_dofs_per_cell(), dim * n_columns), r(n, dim * n_columns);
      unsigned int number = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          lift_cell(number, columns, coarse, in_fine_space);
          std::copy_n(coarse.values.begin(), u.values.size(), u.values.begin());
          cell_residuals.reinit(cell);
          const unsigned int material = material_of(cell);
          if (is_stressed(materials[material]))
          {
            base_map->gather(number, state, u_0);
            cell_residuals.set_stress(
                materials[material].material,
                {base.fe.n_dofs_per_cell(),
                 dim,
                 {u_0.values.begin(), u_0.values.begin() + dim * base.fe.n_dofs_per_cell()}});
          }
          cell_residuals.apply(materials[material].material, by_material[material], u, r);
          for (unsigned int j = 0; j < n_columns; ++j)
            for (const auto &entry : map->cells[number])
              if (entry.unknown < dim * n)
                forces[j].local_element(entry.index) +=
                    entry.weight * r.values[std::size_t(j) * dim * n + entry.unknown];
          ++number;
        }
      for (Column &column : forces)
        column.compress(VectorOperation::add);
      if (!base.has_nodeless_rows() || Utilities::MPI::this_mpi_process(spaces.comm) != 0)
        return;
      // The rows of points and superelements belong to no cell; they are the same on each space.
      const unsigned int n_points      = base.first_local_multiplier - base.first_point,
                         n_multipliers = base.rows.end - base.first_point_multiplier;
      for (unsigned int j = 0; j < n_columns; ++j)
      {
        const auto copy = [&](const unsigned int from, const unsigned int to, const unsigned int n)
        { std::copy_n(columns[j].begin() + from, n, in_fine_space.column(j) + to); };
        copy(base.first_point, spaces.first_point, n_points);
        copy(base.first_point_multiplier, spaces.first_point_multiplier, n_multipliers);
      }
    }

    /// Of modes with measured ratios, (f(l) - 1) sum_k (M phi_k) c_k (M phi_k)^T x: the inner
    /// product is the model's, the force is M phi_k in the enriched space.
    template <int dim>
    void Estimator<dim>::add_measured_damping()
    {
      for (const RelaxationTerm &term : model.relaxation())
      {
        if (!term.low_rank)
          continue;
        // Four blocks of columns are wanted; with a real factor each column is by itself.
        const unsigned int n_shapes = term.low_rank->weights.size(), n_each = (n_shapes + 3) / 4;
        MultiVector shapes = term.low_rank->preimages;
        shapes.append(MultiVector(base.rows, 4 * n_each - n_shapes));
        MultiVector fine_shapes(spaces.rows, 4 * n_each);
        std::vector<Column> forces = map->zeros(4 * n_each);
        const std::vector<OperatorFactors> inertia(n_each, {1., 0., 0., 0., 0., 0.});
        add_bodies(base_map->import(shapes), {materials.size(), inertia}, fine_shapes, forces);
        const MultiVector of_points = multiply(sum_of(spaces.rows, joint_terms, 2), fine_shapes);
        for (unsigned int k = 0; k < n_shapes; ++k)
          for (unsigned int i = 0; i < of_points.n_local(); ++i)
            forces[k].local_element(i) += of_points.column(k)[i];

        for (const bool is_left : {false, true})
        {
          const ComplexMultiVector &x = is_left ? modes.left : modes.right;
          const unsigned int side     = is_left ? 2 * n_vectors : 0;
          const DenseMatrix re        = term.low_rank->weighted_products(x.re),
                            im        = term.low_rank->weighted_products(x.im);
          for (unsigned int j = 0; j < m; ++j)
          {
            const Complex of_right = term.coefficient * (term.factor(modes.lambda[j]) - 1.),
                          factor   = is_left ? std::conj(of_right) : of_right;
            for (unsigned int k = 0; k < n_shapes; ++k)
            {
              const Complex c = factor * Complex(re(k, j), im(k, j));
              for (unsigned int i = 0; i < of_points.n_local(); ++i)
              {
                residuals[side + j].local_element(i) += c.real() * forces[k].local_element(i);
                residuals[side + n_vectors + j].local_element(i) +=
                    c.imag() * forces[k].local_element(i);
              }
            }
          }
        }
      }
    }

    /// One column, interpolated.
    template <int dim>
    MultiVector Estimator<dim>::interpolate(const MultiVector &column)
    {
      const std::vector<Column> imported = base_map->import(column);
      MultiVector result(spaces.rows, 1);
      DenseMatrix coarse;
      for (unsigned int number = 0; number < map->cells.size(); ++number)
        lift_cell(number, imported, coarse, result);
      return result;
    }

    /// The edge of the contact zone stays where it is: pressures are enriched only where all
    /// contacts are closed. The enriched space has nodes on both sides of the edge, and each that
    /// is closed or open by mistake would outweigh all other residuals.
    template <int dim>
    void Estimator<dim>::release_at_edge()
    {
      MultiVector closed(base.rows, 1);
      for (unsigned int row = base.first_local_multiplier; row < base.first_local_tie; ++row)
        closed.data()[row - base.rows.begin] = model.contact()->is_closed(row);
      MultiVector fine_closed = interpolate(closed);
      std::fill(fine_closed.data(),
                fine_closed.data() + (spaces.first_local_multiplier - spaces.rows.begin), 1.);
      std::fill(fine_closed.data() + (spaces.first_local_tie - spaces.rows.begin),
                fine_closed.data() + spaces.rows.n_local(), 1.);
      const std::vector<double> flags = replicate(fine_closed);
      std::vector<unsigned int> released;
      for (unsigned int row = 0; row < flags.size(); ++row)
        if (std::abs(flags[row] - 1) > 1e-9)
          released.push_back(row);
      contact->set_closed(released, false);
    }

    /// Contact on the enriched space, with the static state interpolated.
    template <int dim>
    void Estimator<dim>::pair_contact()
    {
      if (!model.contact() || base.geometry.interfaces.empty())
        return;
      contact = std::make_unique<Contact<dim>>(spaces, BrakeModel<dim>::contact_model(prm));
      contact->scale_as(*model.contact());
      if (model.equilibrium())
      {
        const MultiVector fine_state = interpolate(model.equilibrium()->state);
        if (!prm.contact.mortar())
          contact->update_active_set(fine_state);
        pressure = contact->pressure_of(fine_state);
      }
      else
        pressure = contact->uniform_pressure(prm.pads.pressure);
      if (!prm.prestress.turning_contact)
        return;
      TurningContact turning = turning_contact(*contact, pressure, prm.terms().friction);
      for (Matrix *matrix : {&turning.pressure, &turning.friction})
        if (*matrix)
          turning_terms.push_back(
              {Origin::prestress, 0, 1., std::make_shared<const Matrix>(std::move(*matrix))});
    }

    /// Mortar: pressures of the modes vanish where contact is open, so that constraints need not be
    /// released there.
    template <int dim>
    void Estimator<dim>::add_contact()
    {
      if (!contact)
        return;
      const StageTerms stage = prm.terms();
      ContactPressure slopes; // d tau/d p
      if (stage.friction)
      {
        double largest            = 0;
        std::tie(largest, slopes) = friction_slopes(*contact, pressure);
        for (std::vector<double> &of_interface : slopes)
          for (double &slope : of_interface)
            slope *= largest;
      }
      // What a term is multiplied with, for each vector: the static state has no damping.
      using Factors = std::vector<Complex>;
      Factors of_state(n_vectors, 1.), of_position = of_state, of_velocity = modes.lambda;
      of_velocity.resize(n_vectors);
      if (with_state)
        of_position[m] = 0.;
      const auto factors_of = [&](const ContactProduct &product) -> const Factors &
      {
        if (product.order == 1)
          return of_velocity;
        const bool is_static =
            product.origin == Origin::contact || product.origin == Origin::friction;
        return is_static ? of_state : of_position;
      };
      for (const bool is_left : {false, true})
      {
        SurfaceVectors<dim> surface(*contact, lifted, is_left ? 2 * n_vectors : 0, 2 * n_vectors);
        contact->for_each_pair(
            [&](const unsigned int i, const ContactKinematics<dim> &k)
            {
              std::vector<ContactProduct> products = normal_products(*contact, i, k);
              if (stage.friction && contact->slides(i))
                products.push_back(friction_product(*contact, i, k, slopes));
              if (stage.friction_damping && contact->slides(i))
                for (ContactProduct &product : damping_products(*contact, i, k, pressure))
                  products.push_back(std::move(product));
              std::map<Trace, DenseMatrix> traces, forces;
              // left c f right^T x, right c conj(f) left^T z
              const auto act = [&](const ContactProduct &product, const Trace from, const Trace to)
              {
                const Factors &factors = factors_of(product);
                DenseMatrix &x = traces[from], &y = forces[to];
                if (x.values.empty())
                  x = surface.traces(from, k);
                if (y.values.empty())
                  y = DenseMatrix(2 * n_vectors, k.n_points);
                for (unsigned int q = 0; q < k.n_points; ++q)
                {
                  const double c = product.c[q], *const of_x = &x.values[std::size_t(q) * x.n_rows];
                  double *const of_y = &y.values[std::size_t(q) * y.n_rows];
                  for (unsigned int j = 0; j < n_vectors; ++j)
                  {
                    const double re = c * factors[j].real(),
                                 im = is_left ? -c * factors[j].imag() : c * factors[j].imag();
                    of_y[j] += re * of_x[j] - im * of_x[n_vectors + j];
                    of_y[n_vectors + j] += re * of_x[n_vectors + j] + im * of_x[j];
                  }
                }
              };
              for (const ContactProduct &product : products)
                for (const bool transpose : {false, true})
                {
                  if (transpose && !product.transposed_too)
                    continue;
                  if (transpose == is_left)
                    act(product, product.right, product.left);
                  else
                    act(product, product.left, product.right);
                }
              for (const auto &[trace, of_points] : forces)
                surface.add(trace, k, of_points);
            });
        surface.add_to(residuals);
      }
      for (unsigned int row = spaces.first_local_multiplier;
           row < spaces.first_local_tie && prm.contact.mortar(); ++row)
        if (!contact->is_closed(row)) // Lambda = 0
          for (unsigned int j = 0; j < 4 * n_vectors; ++j)
            residuals[j].local_element(row - spaces.rows.begin) +=
                contact->constraint_stiffness() * lifted.column(j)[row - spaces.rows.begin];
    }

    template <int dim>
    void Estimator<dim>::add_matrices()
    {
      std::vector<Term> terms = joint_terms;
      terms.insert(terms.end(), turning_terms.begin(), turning_terms.end());
      std::array<Matrix, 3> sums;
      for (unsigned int order = 0; order < sums.size(); ++order)
        sums[order] = sum_of(spaces.rows, terms, order);
      for (const bool is_left : {false, true}) // one after the other: copies are large
      {
        if (terms.empty())
          break;
        const unsigned int side   = is_left ? 2 * n_vectors : 0;
        const MultiVector vectors = lifted.columns(side, 2 * n_vectors);
        for (unsigned int order = 0; order < sums.size(); ++order)
        {
          const Matrix &A = sums[order];
          if (!A)
            continue;
          const MultiVector product =
              is_left ? multiply_transposed(A, vectors) : multiply(A, vectors);
          for (unsigned int j = 0; j < m; ++j) // the state has its own terms
          {
            const Complex l      = is_left ? std::conj(modes.lambda[j]) : modes.lambda[j],
                          factor = order == 0   ? 1.
                                   : order == 1 ? l
                                                : l * l;
            for (unsigned int i = 0; i < product.n_local(); ++i)
            {
              const Complex value =
                  factor * Complex(product.column(j)[i], product.column(n_vectors + j)[i]);
              residuals[side + j].local_element(i) += value.real();
              residuals[side + n_vectors + j].local_element(i) += value.imag();
            }
          }
        }
      }
    }

    template <int dim>
    void Estimator<dim>::add_products()
    {
      // By pieces that stay in the cache: copies of all columns would be large.
      constexpr unsigned int longest = 1024;
      DenseMatrix re(n_vectors, n_vectors), im(n_vectors, n_vectors), z, r;
      for (unsigned int first = 0; first < lifted.n_local(); first += longest)
      {
        const unsigned int n_rows = std::min(longest, lifted.n_local() - first);
        if (z.n_rows != n_rows)
          z = r = DenseMatrix(n_rows, 2 * n_vectors);
        for (unsigned int j = 0; j < 2 * n_vectors; ++j)
        {
          std::copy_n(lifted.column(2 * n_vectors + j) + first, n_rows,
                      &z.values[std::size_t(j) * n_rows]);
          std::copy_n(residuals[j].begin() + first, n_rows, &r.values[std::size_t(j) * n_rows]);
        }
        add_product(z, r, re, im);
      }
      for (unsigned int j = 0; j < m; ++j)
        for (unsigned int i = 0; i < m; ++i)
        {
          t_re(i, j) += re(i, j);
          t_im(i, j) += im(i, j);
        }
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
      std::vector<Column> sums = map->zeros(3);
      unsigned int number      = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          const Material &material = materials[material_of(cell)].material;
          cell_residuals.reinit(cell);
          shares.push_back(local->resistance(material, cell_residuals));
          for (const auto &entry : map->cells[number])
            if (entry.direct)
              sums[0].local_element(entry.index) += shares[number][entry.unknown];
            else
            {
              sums[1].local_element(entry.index) += shares[number][entry.unknown];
              sums[2].local_element(entry.index) += 1;
            }
          ++number;
        }
      for (Column &sum : sums)
      {
        sum.compress(VectorOperation::add);
        sum.update_ghost_values();
      }
      const SecondSides<dim> second_sides(spaces, contact.get(), shares);
      for (unsigned int cell = 0; cell < map->cells.size(); ++cell)
        for (const auto &entry : map->cells[cell])
          if (entry.direct)
          {
            const double direct = sums[0].local_element(entry.index),
                         count  = sums[2].local_element(entry.index),
                         // A cell of half the size resists half as much as one that fits.
                hanging = count > 0 ? 2 * sums[1].local_element(entry.index) / count : 0;
            shares[cell][entry.unknown] /= std::sqrt(direct * (direct + hanging));
          }
      second_sides.reduce(shares);
      for (Column &residual : residuals)
        residual.update_ghost_values();
    }

    /// The matrix of a cell's problem if functions of V_h on it give way, too.
    template <int dim>
    DenseMatrix Estimator<dim>::soften(const unsigned int number, const unsigned int material,
                                       const LocalProblem &problem)
    {
      if (!yielding)
        yielding = std::make_unique<YieldingCells<dim>>(local->functions, lift, cell_residuals);
      std::vector<bool> movable(n_fields * base.fe.n_dofs_per_cell());
      for (const auto &entry : base_map->cells[number])
        movable[entry.unknown] = true;
      return yielding->soften(problem, movable, materials[material].material, cell_residuals);
    }

    template <int dim>
    void Estimator<dim>::eliminate(EigenvalueErrors &errors)
    {
      const unsigned int n_w = local->functions.n_columns, n_wide = n_fields * 4 * n_vectors;
      DenseMatrix all(n, n_wide), tested(n_w, n_wide);
      unsigned int number = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
      {
        if (!cell->is_locally_owned())
          continue;
        const unsigned int material = material_of(cell);
        cell_residuals.reinit(cell);
        LocalProblem problem =
            local->make(cell, number, materials[material].material, cell_residuals);
        std::fill(all.values.begin(), all.values.end(), 0.);
        for (unsigned int j = 0; j < 4 * n_vectors; ++j)
          for (const auto &entry : map->cells[number])
            if (entry.direct)
              all.values[std::size_t(j) * n_fields * n + entry.unknown] =
                  shares[number][entry.unknown] * residuals[j].local_element(entry.index);
        gemm(true, 1, local->functions, all, 0, tested);
        const unsigned int n_kept = problem.unknowns.size();
        DenseMatrix r(n_kept, 4 * n_vectors);
        for (unsigned int j = 0; j < 4 * n_vectors; ++j)
          for (unsigned int i = 0; i < n_kept; ++i)
            r(i, j) = tested.values[std::size_t(j) * n_fields * n_w + problem.unknowns[i]];
        const bool yields =
            locks[material] || is_long_at_support<dim>(cell, base.geometry.supports);
        DenseMatrix softer;
        if (yields)
          softer = soften(number, material, problem);
        const DenseMatrix right = half(r, false), left = half(r, true),
                          solution = problem.symmetric
                                         ? solve_positive(std::move(problem.matrix), right)
                                         : solve(std::move(problem.matrix), right);
        DenseMatrix e_re(n_vectors, n_vectors), e_im(n_vectors, n_vectors);
        add_product(left, solution, e_re, e_im);
        DenseMatrix more_re(n_vectors, n_vectors), more_im(n_vectors, n_vectors);
        if (yields)
          add_product(left,
                      problem.symmetric ? solve_positive(std::move(softer), right)
                                        : solve(std::move(softer), right),
                      more_re, more_im);
        std::vector<std::complex<float>> parts;
        for (unsigned int j = 0; j < m; ++j)
          for (unsigned int i = 0; i < m; ++i)
          {
            // Damping makes the stiffness complex.
            const OperatorFactors &c = factors[material][j];
            const Complex stiffness  = c.k + c.v * proportions[material];
            const Complex e          = Complex(e_re(i, j), e_im(i, j)) / stiffness;
            t_re(i, j) -= e.real();
            t_im(i, j) -= e.imag();
            if (yields)
            {
              const Complex more = Complex(more_re(i, j), more_im(i, j)) / stiffness - e;
              yielding_re(i, j) -= more.real();
              yielding_im(i, j) -= more.imag();
            }
            if (i == j)
              parts.emplace_back(e / (2. * modes.lambda[j]));
          }
        errors.cells.push_back(std::move(parts));
        if (with_state)
          add_state_correction(local->functions, number, problem.unknowns,
                               &solution.values[n_kept * m]);
        ++number;
      }
    }

    /// What a cell's problem adds to the static state. Functions on faces appear in each cell's
    /// problem, with its share of the residual: their mean counts.
    template <int dim>
    void
    Estimator<dim>::add_state_correction(const DenseMatrix &functions, const unsigned int number,
                                         const std::vector<int> &unknowns, const double *solution)
    {
      const unsigned int n_w = functions.n_columns;
      std::vector<double> values(n_fields * n);
      for (unsigned int r = 0; r < unknowns.size(); ++r)
        for (unsigned int a = 0; a < n; ++a)
          values[unknowns[r] / n_w * n + a] += functions(a, unknowns[r] % n_w) * solution[r];
      for (const auto &entry : map->cells[number])
        if (entry.direct)
        {
          state_correction[0].local_element(entry.index) += values[entry.unknown];
          state_correction[1].local_element(entry.index) += 1;
        }
    }

    /// K x_0 + N Lambda_0 + mu T Lambda_0 - f of the interpolated state: the parts of bodies and
    /// contact are there.
    template <int dim>
    void Estimator<dim>::add_static_residual()
    {
      const MultiVector state   = lifted.columns(m, 1),
                        loads[] = {model.static_load(prm, spaces),
                                   contact_load(*contact, pressure, prm.terms().friction)};
      const auto add            = [&](const double factor, const MultiVector &block)
      {
        for (unsigned int i = 0; i < block.n_local(); ++i)
          residuals[m].local_element(i) += factor * block.data()[i];
      };
      for (const Term &term : joint_terms)
        if (term.order == 0)
          add(term.coefficient, multiply(*term.matrix, state));
      for (const MultiVector &load : loads)
        add(-1, load);
    }

    /// First-order changes of the eigenvalues, like F, by the steady pressure's own error:
    ///     -2 z_i^H (dQ + l_j dP) x_j / (2 l_i),
    /// dP and dQ the friction damping of what the local problems add to the pressure. The two is
    /// for the answer of V_h to that, which is of the same size and would cost a factorisation.
    template <int dim>
    std::vector<Complex> Estimator<dim>::other_pressure()
    {
      MultiVector state = lifted.columns(m, 1);
      state_correction[0].compress(VectorOperation::add);
      state_correction[1].compress(VectorOperation::add);
      for (unsigned int i = 0; i < state.n_local(); ++i)
        if (const double count = state_correction[1].local_element(i); count > 0)
          state.data()[i] += state_correction[0].local_element(i) / count;
      const ContactPressure other = contact->pressure_of(state);
      const SurfaceVectors<dim> x_vectors(*contact, lifted, 0, 2 * n_vectors),
          z_vectors(*contact, lifted, 2 * n_vectors, 2 * n_vectors);
      // [Re Z, Im Z]^T dP [Re X, Im X] and the same of dQ, by order
      std::array<DenseMatrix, 2> forms;
      for (DenseMatrix &form : forms)
        form = DenseMatrix(2 * n_vectors, 2 * n_vectors);
      contact->for_each_sliding_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            const std::vector<ContactProduct> before = damping_products(*contact, i, k, pressure),
                                              after  = damping_products(*contact, i, k, other);
            for (unsigned int p = 0; p < before.size(); ++p)
            {
              const DenseMatrix z = z_vectors.traces(before[p].left, k);
              DenseMatrix x       = x_vectors.traces(before[p].right, k);
              for (unsigned int q = 0; q < k.n_points; ++q)
                for (unsigned int j = 0; j < x.n_rows; ++j)
                  x(j, q) *= after[p].c[q] - before[p].c[q];
              squeal::add(1., outer_product(z, x), forms[before[p].order]);
            }
          });
      std::vector<Complex> f(m * m);
      for (unsigned int order = 0; order < 2; ++order)
      {
        DenseMatrix &form = forms[order];
        MPI_Allreduce(MPI_IN_PLACE, form.values.data(), form.values.size(), MPI_DOUBLE, MPI_SUM,
                      spaces.comm);
        for (unsigned int i = 0; i < m; ++i)
          for (unsigned int j = 0; j < m; ++j)
          {
            const Complex product(form(i, j) + form(n_vectors + i, n_vectors + j),
                                  form(i, n_vectors + j) - form(n_vectors + i, j));
            f[i + m * j] -= (order == 0 ? 1. : modes.lambda[j]) * product / modes.lambda[i];
          }
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
            const Complex l      = modes.lambda[j];
            const double omega   = std::abs(l);
            const Complex answer = 1. + l * prm.modal_damping.slope(omega / (2 * M_PI)) / omega;
            for (unsigned int i = 0; i < m && !effects.empty(); ++i)
              effects[i + m * j] *= answer;
          }
    }

    /// Corrections and bounds out of T, summed over all ranks.
    template <int dim>
    void Estimator<dim>::find_corrections(EigenvalueErrors &errors)
    {
      // T, what may come to it where V_h follows, then sum |Re| of the cells' parts of each mode
      std::vector<double> sums;
      for (const DenseMatrix *block : {&t_re, &t_im, &yielding_re, &yielding_im})
        sums.insert(sums.end(), block->values.begin(), block->values.end());
      sums.resize(4 * m * m + m);
      for (const auto &cell : errors.cells)
        for (unsigned int j = 0; j < m; ++j)
          sums[4 * m * m + j] += std::abs(cell[j].real());
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM, spaces.comm);
      std::vector<Complex> f(m * m), yielding_effect(m * m);
      for (unsigned int i = 0; i < m; ++i)
        for (unsigned int j = 0; j < m; ++j)
          for (std::vector<Complex> *effect : {&f, &yielding_effect})
          {
            const double *block = &sums[effect == &f ? 0 : 2 * m * m];
            (*effect)[i + m * j] =
                -Complex(block[i + m * j], block[m * m + i + m * j]) / (2. * modes.lambda[i]);
          }
      add_answer_of_damping(f);
      add_answer_of_damping(yielding_effect);
      std::vector<std::vector<Complex>> edges = other_edges(errors);
      for (std::vector<Complex> &edge : edges)
        add_answer_of_damping(edge);
      ErrorEffects &effects = errors.effects;
      effects = {std::move(f), {sums.end() - m, sums.end()}, base.fe.degree, {std::move(edges)}};
      if (with_state)
        effects.alternatives.push_back({other_pressure()});
      // The same on all ranks, whichever has such cells
      if (std::any_of(yielding_effect.begin(), yielding_effect.end(),
                      [](const Complex e) { return e != 0.; }))
        effects.alternatives.push_back({yielding_effect});
      errors.bounds = bound_errors(modes.lambda, modes.parity, effects);
    }

    /// First-order changes of the eigenvalues by another edge of the contact zone, like F. Their
    /// parts go to the pads' cells that share the edge's nodes.
    template <int dim>
    std::vector<std::vector<Complex>> Estimator<dim>::other_edges(EigenvalueErrors &errors) const
    {
      if (!model.equilibrium())
        return {};
      EdgeEffects effects = edge_effects(model.equilibrium()->edge, modes.right, modes.left);
      if (effects.rows.empty())
        return {};
      for (unsigned int k = 0; k < m * m; ++k)
        for (std::vector<Complex> *products :
             {&effects.smaller, &effects.larger, &effects.likeliest})
          (*products)[k] /= -2. * modes.lambda[k % m];

      // By row: its number in the list plus one
      std::vector<Column> places = base_map->zeros(1);
      for (unsigned int i = 0; i < effects.rows.size(); ++i)
        if (base.rows.contains(effects.rows[i]))
          places[0].local_element(effects.rows[i] - base.rows.begin) = i + 1;
      places[0].update_ghost_values();
      for (unsigned int cell = 0; cell < errors.cells.size(); ++cell)
        for (const auto &entry : base_map->cells[cell])
          if (const unsigned int place = places[0].local_element(entry.index); place > 0)
            for (unsigned int j = 0; j < m; ++j)
              errors.cells[cell][j] += effects.parts[place - 1][j] / (2. * modes.lambda[j]);
      return {std::move(effects.smaller), std::move(effects.larger), std::move(effects.likeliest)};
    }

    template <int dim>
    EigenvalueErrors Estimator<dim>::run()
    {
      EigenvalueErrors errors;
      if (m == 0)
        return errors;
      spaces.distribute();
      base_map         = std::make_unique<CellMap<dim>>(base);
      map              = std::make_unique<CellMap<dim>>(spaces);
      lifted           = MultiVector(spaces.rows, 4 * n_vectors);
      residuals        = map->zeros(4 * n_vectors);
      state_correction = map->zeros(2);
      pair_contact();
      joint_terms = model.joint_terms(spaces);
      add_bodies(import_columns(), factors, lifted, residuals);
      add_contact();
      add_matrices();
      add_measured_damping();
      if (with_state)
        add_static_residual();
      if (contact && prm.contact.mortar())
        release_at_edge();
      add_products();
      local = std::make_unique<LocalProblems<dim>>(spaces, *map, cell_residuals, contact.get(),
                                                   prm.pads.pressure, prm.terms().friction,
                                                   model.ties().scale);
      share_faces();
      eliminate(errors);
      find_corrections(errors);
      return errors;
    }
  } // namespace

  template <int dim>
  EigenvalueErrors estimate_errors(const BrakeModel<dim> &model, const EigenPairs &modes)
  {
    return Estimator<dim>(model, modes).run();
  }

  template EigenvalueErrors estimate_errors<2>(const BrakeModel<2> &, const EigenPairs &);
  template EigenvalueErrors estimate_errors<3>(const BrakeModel<3> &, const EigenPairs &);
} // namespace squeal

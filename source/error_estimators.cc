#include <squeal/cell_map.h>
#include <squeal/cell_operators.h>
#include <squeal/error_estimators.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/fe/fe_values.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;
  using Complex = std::complex<double>;

  namespace
  {
    /// [Re X, Im X, Re Z, Im Z] of all modes.
    Block columns_of(const Modes &modes)
    {
      Block columns = modes.re;
      columns.append(modes.im);
      columns.append(modes.left_re);
      columns.append(modes.left_im);
      return columns;
    }

    /// Sums of body terms at the eigenvalue l: sum c l^order for each kind of matrix.
    std::array<Complex, 4> coefficients_at(const std::vector<BodyTerm> &terms, const Complex l)
    {
      std::array<Complex, 4> sums{};
      for (const BodyTerm &term : terms)
        sums[static_cast<unsigned int>(term.matrix)] +=
            term.coefficient * (term.order == 0   ? 1.
                                : term.order == 1 ? l
                                                  : l * l);
      return sums;
    }

    template <int dim>
    class Estimator
    {
    public:
      Estimator(const BrakeModel<dim> &model, const Modes &modes);
      EigenvalueErrors run();

    private:
      using CellIterator = typename DoFHandler<dim>::active_cell_iterator;
      void find_contact_terms();
      /// The unknowns of a cell in the space of one degree more, which also go to @p result.
      DenseMatrix lift_cell(unsigned int number, const std::vector<Column> &columns,
                            Block &result) const;
      void add_bodies();
      void integrate(const CellIterator &cell, const DenseMatrix &u, DenseMatrix &r,
                     DenseMatrix &stiffness);
      void add_contact();
      void share_faces();
      DenseMatrix local_problem(const CellIterator &cell, unsigned int number,
                                const DenseMatrix &stiffness, std::vector<int> &kept) const;
      /// The face of a pad's cell that is in contact, or -1.
      int contact_face(const CellIterator &cell) const;
      void add_pressures(const CellIterator &cell, const std::vector<bool> &direct,
                         std::vector<int> &kept) const;
      void add_local_contact(const CellIterator &cell, const std::vector<int> &kept,
                             DenseMatrix &local) const;
      void add_products(const DenseMatrix &z, const DenseMatrix &r, DenseMatrix &re,
                        DenseMatrix &im) const;
      void eliminate(EigenvalueErrors &errors);
      void find_corrections(EigenvalueErrors &errors) const;

      const BrakeModel<dim> &model;
      const Parameters::All &prm;
      const Modes &modes;
      const unsigned int m;    ///< modes
      const Spaces<dim> &base; ///< of the modes
      Spaces<dim> spaces;      ///< of one degree more
      std::unique_ptr<Contact<dim>> contact;
      std::vector<Term> contact_terms;

      const unsigned int n; ///< nodes of a cell, degree p + 1
      const DenseMatrix lift;
      const DenseMatrix complement;
      CellIntegrals<dim> resting, moving;
      std::unique_ptr<CellMap<dim>> base_map, map;
      Block lifted;                         ///< the columns, interpolated
      std::vector<Column> residuals;        ///< of the columns
      std::vector<DenseMatrix> stiffnesses; ///< of the cells' complements
      std::vector<std::vector<int>> unknowns;
      const std::vector<Parameters::BodyMaterial> materials;
      /// By material: the factors of its matrices at each eigenvalue, and whether it moves.
      std::vector<std::vector<std::array<Complex, 4>>> factors;
      std::vector<bool> has_transport;
      std::vector<unsigned int> material_of_cell;
      DenseMatrix t_re, t_im; ///< T
    };

    template <int dim>
    Estimator<dim>::Estimator(const BrakeModel<dim> &model, const Modes &modes)
        : model(model), prm(model.parameters()), modes(modes), m(modes.lambda.size()),
          base(model.spaces()), spaces(base, base.fe.degree + 1), n(spaces.fe.n_dofs_per_cell()),
          lift(interpolation(base.fe, spaces.fe)), complement(hierarchical_complement(spaces.fe)),
          resting(spaces, false), moving(spaces, true), materials(prm.materials()), t_re(m, m),
          t_im(m, m)
    {
    }

    /// r = [Q+(l_j) x_j, Q+(l_j)^H z_j] of one cell for the columns u, and the cell's stiffness.
    template <int dim>
    void Estimator<dim>::integrate(const CellIterator &cell, const DenseMatrix &u, DenseMatrix &r,
                                   DenseMatrix &stiffness)
    {
      const unsigned int number     = base.geometry.parts[cell->material_id()].material;
      const bool moves              = has_transport[number];
      CellIntegrals<dim> &integrals = moves ? moving : resting;
      integrals.reinit(cell);
      const Material &material = materials[number].material;
      const auto C             = elasticity_tensor<dim>(material);
      DenseMatrix block(n, n);
      for (unsigned int i = 0; i < dim; ++i)
        for (unsigned int k = i; k < dim; ++k)
        {
          stiffness_block(integrals, C, i, k, block);
          for (unsigned int a = 0; a < n; ++a)
            for (unsigned int b = 0; b < n; ++b)
              stiffness(i * n + a, k * n + b) = stiffness(k * n + b, i * n + a) = block(b, a);
        }
      const unsigned int n_columns = u.n_columns;
      std::array<DenseMatrix, 4> products;
      const auto apply = [&](const BodyTerm::Kind kind, const auto &entry)
      {
        // The same for every component: the columns read as n x (dim n_columns).
        for (unsigned int a = 0; a < n; ++a)
          for (unsigned int b = 0; b < n; ++b)
            block(a, b) = material.density * entry(a, b);
        DenseMatrix wide(n, dim * n_columns, u.values);
        DenseMatrix result(n, dim * n_columns);
        gemm(false, 1, block, wide, 0, result);
        products[static_cast<unsigned int>(kind)] =
            DenseMatrix(dim * n, n_columns, std::move(result.values));
      };
      products[1] = DenseMatrix(dim * n, n_columns);
      gemm(false, 1, stiffness, u, 0, products[1]);
      apply(BodyTerm::Kind::M,
            [&](const unsigned int a, const unsigned int b) { return integrals.values(a, b); });
      if (moves)
      {
        apply(BodyTerm::Kind::G, [&](const unsigned int a, const unsigned int b)
              { return (integrals.value_transport(a, b) - integrals.value_transport(b, a)) / 2; });
        apply(BodyTerm::Kind::M_star, [&](const unsigned int a, const unsigned int b)
              { return integrals.transports(a, b); });
      }
      std::fill(r.values.begin(), r.values.end(), 0.);
      for (unsigned int j = 0; j < m; ++j)
      {
        const std::array<Complex, 4> &c = factors[number][j];
        for (unsigned int kind = 0; kind < 4; ++kind)
          if (products[kind].n_rows > 0)
          {
            const DenseMatrix &product = products[kind];
            // Q^H: conjugate coefficients, and G is skew
            const Complex adjoint =
                std::conj(c[kind]) *
                (kind == static_cast<unsigned int>(BodyTerm::Kind::G) ? -1. : 1.);
            for (const unsigned int side : {0u, 2 * m})
            {
              const Complex factor = side == 0 ? c[kind] : adjoint;
              for (unsigned int i = 0; i < dim * n; ++i)
              {
                const Complex value =
                    factor * Complex(product(i, side + j), product(i, side + m + j));
                r(i, side + j) += value.real();
                r(i, side + m + j) += value.imag();
              }
            }
          }
      }
    }

    /// Adds Z^H R of two blocks of columns [Re, Im].
    template <int dim>
    void Estimator<dim>::add_products(const DenseMatrix &z, const DenseMatrix &r, DenseMatrix &re,
                                      DenseMatrix &im) const
    {
      DenseMatrix products(2 * m, 2 * m);
      gemm(true, 1, z, r, 0, products);
      for (unsigned int i = 0; i < m; ++i)
        for (unsigned int j = 0; j < m; ++j)
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
    DenseMatrix Estimator<dim>::lift_cell(const unsigned int number,
                                          const std::vector<Column> &columns, Block &result) const
    {
      const unsigned int n_base = base.fe.n_dofs_per_cell(), n_columns = columns.size(),
                         n_wide = (dim + 1) * n_columns;
      DenseMatrix coarse((dim + 1) * n_base, n_columns), fine(n, n_wide);
      base_map->gather(number, columns, coarse);
      // The same for every component: the columns read as n x ((dim + 1) n_columns).
      gemm(false, 1, lift, DenseMatrix(n_base, n_wide, std::move(coarse.values)), 0, fine);
      DenseMatrix unknowns_of_cell((dim + 1) * n, n_columns, std::move(fine.values));
      for (const auto &entry : map->cells[number])
        if (entry.direct && entry.index < result.n_local())
          for (unsigned int j = 0; j < n_columns; ++j)
            result.column(j)[entry.index] = unknowns_of_cell(entry.unknown, j);
      return unknowns_of_cell;
    }

    template <int dim>
    void Estimator<dim>::add_bodies()
    {
      const std::vector<Column> columns = base_map->import(columns_of(modes));
      DenseMatrix u(dim * n, 4 * m), r(dim * n, 4 * m), stiffness(dim * n, dim * n);
      for (const Parameters::BodyMaterial &material : materials)
      {
        const std::vector<BodyTerm> terms = body_terms(prm, material);
        has_transport.push_back(needs_transport(terms));
        factors.emplace_back();
        for (const Complex &l : modes.lambda)
          factors.back().push_back(coefficients_at(terms, l));
      }
      unsigned int number = 0;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
        if (cell->is_locally_owned())
        {
          const DenseMatrix all = lift_cell(number, columns, lifted);
          for (unsigned int j = 0; j < 4 * m; ++j)
            std::copy_n(&all.values[std::size_t(j) * all.n_rows], dim * n,
                        &u.values[std::size_t(j) * u.n_rows]);
          integrate(cell, u, r, stiffness);
          for (const auto &entry : map->cells[number])
            if (entry.unknown < dim * n)
              for (unsigned int j = 0; j < 4 * m; ++j)
                residuals[j].local_element(entry.index) += entry.weight * r(entry.unknown, j);
          add_products(half(u, true), half(r, false), t_re, t_im);
          material_of_cell.push_back(base.geometry.parts[cell->material_id()].material);
          stiffnesses.push_back(local_problem(cell, number, stiffness, unknowns.emplace_back()));
          ++number;
        }
      for (Column &column : residuals)
        column.compress(VectorOperation::add);
    }

    /// Contact on the enriched space: the static state interpolated, its own active set.
    template <int dim>
    void Estimator<dim>::find_contact_terms()
    {
      if (!model.contact() || base.geometry.interfaces.empty())
        return;
      contact = std::make_unique<Contact<dim>>(spaces, BrakeModel<dim>::contact_model(prm));
      contact->scale_as(*model.contact());
      typename Contact<dim>::Pressure pressure;
      if (model.equilibrium())
      {
        const std::vector<Column> state = base_map->import(model.equilibrium()->state);
        Block fine_state(spaces.rows, 1);
        for (unsigned int number = 0; number < map->cells.size(); ++number)
          lift_cell(number, state, fine_state);
        contact->update_active_set(fine_state);
        pressure = contact->pressure_of(fine_state);
      }
      else
        pressure = contact->uniform_pressure(prm.pads.pressure);
      contact_terms = BrakeModel<dim>::contact_terms(*contact, pressure, prm);
    }

    template <int dim>
    void Estimator<dim>::add_contact()
    {
      if (!contact)
        return;
      Block right(spaces.rows, 2 * m), left(spaces.rows, 2 * m);
      std::copy_n(lifted.data(), std::size_t(right.n_local()) * 2 * m, right.data());
      std::copy_n(lifted.column(2 * m), std::size_t(right.n_local()) * 2 * m, left.data());
      for (const unsigned int order : {0u, 1u})
      {
        const Matrix A = sum_of(spaces.rows, contact_terms, order);
        if (!A)
          continue;
        const std::array<Block, 2> products = {{multiply(A, right), multiply(transpose(A), left)}};
        for (const bool is_left : {false, true})
          for (unsigned int j = 0; j < m; ++j)
          {
            const Complex l = modes.lambda[j], factor = order == 0 ? 1.
                                                        : is_left  ? std::conj(l)
                                                                   : l;
            const Block &product    = products[is_left];
            const unsigned int side = is_left ? 2 * m : 0;
            for (unsigned int i = 0; i < product.n_local(); ++i)
            {
              const Complex value =
                  factor * Complex(product.column(j)[i], product.column(m + j)[i]);
              residuals[side + j].local_element(i) += value.real();
              residuals[side + m + j].local_element(i) += value.imag();
              if (!is_left)
                for (unsigned int k = 0; k < m && value != 0.; ++k)
                {
                  const Complex t = Complex(left.column(k)[i], -left.column(m + k)[i]) * value;
                  t_re(k, j) += t.real();
                  t_im(k, j) += t.imag();
                }
            }
          }
      }
    }

    /// Residuals of faces, edges and vertices are divided among the cells that share them: with m
    /// cells that have a local problem there, out of m' whose stiffness resists, each takes
    /// 1/sqrt(m m') of it, so that the local energies sum to the right one for equal cells. m' > m
    /// where finer cells hang on a face.
    template <int dim>
    void Estimator<dim>::share_faces()
    {
      std::vector<Column> counts = map->zeros(2);
      for (const auto &entries : map->cells)
        for (const auto &entry : entries)
          counts[!entry.direct].local_element(entry.index) += 1;
      for (Column &count : counts)
      {
        count.compress(VectorOperation::add);
        count.update_ghost_values();
      }
      std::vector<double> shares(lifted.n_local());
      for (unsigned int i = 0; i < shares.size(); ++i)
      {
        const double direct = counts[0].local_element(i),
                     all    = direct + (counts[1].local_element(i) > 0);
        shares[i]           = std::sqrt(std::max(1., direct * all));
      }
      for (Column &residual : residuals)
      {
        for (unsigned int i = 0; i < shares.size(); ++i)
          residual.local_element(i) /= shares[i];
        residual.update_ghost_values();
      }
    }

    template <int dim>
    int Estimator<dim>::contact_face(const CellIterator &cell) const
    {
      for (const unsigned int f : cell->face_indices())
        for (const ContactInterface &interface : spaces.geometry.interfaces)
          if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == interface.pad_face)
            return f;
      return -1;
    }

    /// Appends the contact pressures of a pad's cell: the traces of the complement's functions that
    /// do not vanish on the contact face, where it is closed.
    template <int dim>
    void Estimator<dim>::add_pressures(const CellIterator &cell, const std::vector<bool> &direct,
                                       std::vector<int> &kept) const
    {
      const int face = contact_face(cell);
      if (face < 0 || !prm.contact.mortar())
        return;
      const std::vector<Point<dim>> &points = spaces.fe.get_unit_support_points();
      std::vector<types::global_dof_index> nodes(n);
      cell->get_dof_indices(nodes);
      for (unsigned int w = 0; w < complement.n_columns; ++w)
      {
        bool on_face = false, is_free = true;
        for (unsigned int a = 0; a < n; ++a)
          if (complement(a, w) != 0 && std::abs(points[a][face / 2] - face % 2) < 1e-12)
          {
            on_face = true;
            is_free &= direct[dim * n + a] && contact->is_closed(spaces.multiplier(nodes[a]));
          }
        if (on_face && is_free)
          kept.push_back(dim * complement.n_columns + w);
      }
    }

    /// The contact's part of a pad's local problem, the rotor held: with v.n and v.e along the
    /// rotor's normal and the sliding direction, penalty
    ///     int (v.n + mu v.e) k_C u.n,
    /// mortar -int (v.n + mu v.e) p, -int psi u.n - 1/k_C int psi p.
    template <int dim>
    void Estimator<dim>::add_local_contact(const CellIterator &cell, const std::vector<int> &kept,
                                           DenseMatrix &local) const
    {
      const int face = contact_face(cell);
      if (face < 0)
        return;
      const ContactModel<dim> &law = contact->contact_model();
      const double scale = contact->pressure_scale(), omega = law.angular_velocity;
      FEFaceValues<dim> values(spaces.mapping, spaces.fe, QGauss<dim - 1>(spaces.fe.degree + 1),
                               update_values | update_normal_vectors | update_quadrature_points |
                                   update_JxW_values);
      values.reinit(cell, face);
      const unsigned int n_w = complement.n_columns, n_kept = kept.size();
      std::vector<double> traces(n_w);
      for (const unsigned int q : values.quadrature_point_indices())
      {
        const Tensor<1, dim> normal = -values.normal_vector(q);
        Tensor<1, dim> e            = spaces.geometry.transport(values.quadrature_point(q));
        e -= (e * normal) * normal;
        const double speed = e.norm();
        e *= (omega < 0 ? -1 : 1) / speed;
        const double mu =
            prm.terms().friction
                ? law.friction.traction(std::abs(omega) * speed, prm.pads.pressure).d_pressure
                : 0.;
        for (unsigned int w = 0; w < n_w; ++w)
        {
          traces[w] = 0;
          for (unsigned int a = 0; a < n; ++a)
            traces[w] += complement(a, w) * values.shape_value(a, q);
        }
        const double k = law.mortar ? 0 : law.penalty_stiffness;
        for (unsigned int r = 0; r < n_kept; ++r)
        {
          const unsigned int c = kept[r] / n_w;
          const double v       = traces[kept[r] % n_w];
          for (unsigned int s = 0; s < n_kept; ++s)
          {
            const unsigned int d = kept[s] / n_w;
            const double u       = traces[kept[s] % n_w];
            double value         = 0;
            if (c < dim && d < dim)
              value = k * (normal[c] + mu * e[c]) * normal[d];
            else if (c < dim)
              value = -scale * (normal[c] + mu * e[c]);
            else if (d < dim)
              value = -scale * normal[d];
            else
              value = -scale * scale * law.compliance;
            local(r, s) += values.JxW(q) * v * u * value;
          }
        }
      }
    }

    /// The stiffness of the complement's functions on a cell. @p kept lists them: component times
    /// number of functions plus function (contact pressures: component dim); those that would move
    /// a fixed or a hanging node are left out.
    template <int dim>
    DenseMatrix Estimator<dim>::local_problem(const CellIterator &cell, const unsigned int number,
                                              const DenseMatrix &stiffness,
                                              std::vector<int> &kept) const
    {
      const unsigned int n_w = complement.n_columns;
      std::vector<bool> direct((dim + 1) * n);
      for (const auto &entry : map->cells[number])
        direct[entry.unknown] = direct[entry.unknown] || entry.direct;
      const auto is_free = [&](const unsigned int c, const unsigned int w)
      {
        for (unsigned int a = 0; a < n; ++a)
          if (complement(a, w) != 0 && !direct[c * n + a])
            return false;
        return true;
      };
      for (unsigned int c = 0; c < dim; ++c)
        for (unsigned int w = 0; w < n_w; ++w)
          if (is_free(c, w))
            kept.push_back(c * n_w + w);

      add_pressures(cell, direct, kept);
      DenseMatrix local(kept.size(), kept.size());
      DenseMatrix block(n, n), half_product(n, n_w), product(n_w, n_w);
      for (unsigned int i = 0; i < dim; ++i)
        for (unsigned int k = 0; k < dim; ++k)
        {
          for (unsigned int a = 0; a < n; ++a)
            for (unsigned int b = 0; b < n; ++b)
              block(a, b) = stiffness(i * n + a, k * n + b);
          gemm(false, 1, block, complement, 0, half_product);
          gemm(true, 1, complement, half_product, 0, product);
          for (unsigned int r = 0; r < kept.size(); ++r)
            for (unsigned int s = 0; s < kept.size(); ++s)
              if (kept[r] / n_w == i && kept[s] / n_w == k)
                local(r, s) = product(kept[r] % n_w, kept[s] % n_w);
        }
      add_local_contact(cell, kept, local);
      return local;
    }

    template <int dim>
    void Estimator<dim>::eliminate(EigenvalueErrors &errors)
    {
      const unsigned int n_w = complement.n_columns;
      DenseMatrix all((dim + 1) * n, 4 * m);
      for (unsigned int number = 0; number < map->cells.size(); ++number)
      {
        std::fill(all.values.begin(), all.values.end(), 0.);
        for (const auto &entry : map->cells[number])
          if (entry.direct)
            for (unsigned int j = 0; j < 4 * m; ++j)
              all(entry.unknown, j) = residuals[j].local_element(entry.index);
        const std::vector<int> &kept = unknowns[number];
        DenseMatrix r(kept.size(), 4 * m);
        for (unsigned int i = 0; i < kept.size(); ++i)
        {
          const unsigned int c = kept[i] / n_w, w = kept[i] % n_w;
          for (unsigned int a = 0; a < n; ++a)
            if (complement(a, w) != 0)
              for (unsigned int j = 0; j < 4 * m; ++j)
                r(i, j) += complement(a, w) * all(c * n + a, j);
        }
        const DenseMatrix solution = solve(std::move(stiffnesses[number]), half(r, false));
        DenseMatrix e_re(m, m), e_im(m, m);
        add_products(half(r, true), solution, e_re, e_im);
        std::vector<std::complex<float>> parts;
        for (unsigned int j = 0; j < m; ++j)
          for (unsigned int i = 0; i < m; ++i)
          {
            // Damping makes the stiffness complex.
            const Complex e =
                Complex(e_re(i, j), e_im(i, j)) /
                factors[material_of_cell[number]][j][static_cast<unsigned int>(BodyTerm::Kind::K)];
            t_re(i, j) -= e.real();
            t_im(i, j) -= e.imag();
            if (i == j)
              parts.emplace_back(e / (2. * modes.lambda[j]));
          }
        errors.cells.push_back(std::move(parts));
      }
    }

    /// Corrections and bounds out of T, summed over all ranks.
    template <int dim>
    void Estimator<dim>::find_corrections(EigenvalueErrors &errors) const
    {
      // T, then sum |Re| of the cells' parts of each mode
      std::vector<double> sums = t_re.values;
      sums.insert(sums.end(), t_im.values.begin(), t_im.values.end());
      sums.resize(2 * m * m + m);
      for (const auto &cell : errors.cells)
        for (unsigned int j = 0; j < m; ++j)
          sums[2 * m * m + j] += std::abs(cell[j].real());
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM, spaces.comm);
      std::vector<Complex> f(m * m);
      for (unsigned int i = 0; i < m; ++i)
        for (unsigned int j = 0; j < m; ++j)
          f[i + m * j] =
              -Complex(sums[i + m * j], sums[m * m + i + m * j]) / (2. * modes.lambda[i]);
      errors.bounds = bound_errors(modes.lambda, f, {sums.end() - m, sums.end()}, base.fe.degree);
      for (unsigned int j = 0; j < m; ++j)
      {
        const double algebraic =
            std::abs(modes.lambda[j]) * modes.backward_error[j] * modes.condition[j];
        errors.bounds.growth_rate[j] += algebraic;
        errors.bounds.imaginary[j] += algebraic;
      }
    }

    template <int dim>
    EigenvalueErrors Estimator<dim>::run()
    {
      EigenvalueErrors errors;
      if (m == 0)
        return errors;
      spaces.distribute();
      base_map  = std::make_unique<CellMap<dim>>(base);
      map       = std::make_unique<CellMap<dim>>(spaces);
      lifted    = Block(spaces.rows, 4 * m);
      residuals = map->zeros(4 * m);
      find_contact_terms();
      add_bodies();
      add_contact();
      share_faces();
      eliminate(errors);
      find_corrections(errors);
      return errors;
    }
  } // namespace

  template <int dim>
  EigenvalueErrors estimate_errors(const BrakeModel<dim> &model, const Modes &modes)
  {
    return Estimator<dim>(model, modes).run();
  }

  template EigenvalueErrors estimate_errors<2>(const BrakeModel<2> &, const Modes &);
  template EigenvalueErrors estimate_errors<3>(const BrakeModel<3> &, const Modes &);
} // namespace squeal

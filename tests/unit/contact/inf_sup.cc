#include "statics.h"
#include <squeal/contact/contact_matrices.h>
#include <squeal/linalg/factorization.h>

#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <map>
namespace squeal::tests::inf_sup_tests
{
  using namespace dealii;

  // The inf-sup constant of the multipliers (pressures on the pad's face), measured.
  //
  // Mesh h carries displacements V_h and multipliers M_h. With the norm |v|_A^2 = v^T A v, A = K +
  // omega^2 M, of the two bodies, the pressure l in M_h has the dual norm
  //     |l|_h = sup over v in V_h of  int l [[v]].n / |v|_A,     |l|_h^2 = l^T B_h A_h^{-1} B_h^T
  //     l,
  // and the same l has in a much richer space V_f, on a refined mesh of higher degree, nearly its
  // true norm |l|. Always |l|_h <= |l|; the inf-sup constant is
  //     beta = min over l in M_h of |l|_h / |l|.
  // Stable means: bounded below whatever the mesh.
  //
  // What theory says. M_h is the trace space of the pad's normal displacement, its edge nodes
  // included, for no displacement is fixed on the pad's contact face. So the pad alone can answer
  // each l: the L2 projection onto its own traces is stable in H^{1/2}, and beta is bounded below
  // by a constant of the degree and of the ratio of the cells' sizes, whatever the rotor's mesh.
  // The norm adds the compliances of both bodies, |l|^2 = |l|_P^2 + |l|_R^2. A rotor coarser than
  // the pad does not see all l. If it sees none of a certain l, beta^2 is still the pad's share
  // |l|_P^2 / |l|^2, near E_R / (E_R + E_P): good while the multipliers lie on the softer body, as
  // on a brake, and poor on the stiffer body if that is meshed finer.

  namespace
  {
    /// All multipliers of one mesh.
    template <int dim>
    struct MultiplierNode
    {
      int equation;
      Point<dim> x;
    };

    template <int dim>
    std::vector<MultiplierNode<dim>> multiplier_nodes(const Contact<dim> &contact)
    {
      std::map<int, Point<dim>> found;
      for (const ContactFace<dim> &face : contact.paired_interfaces()[0].pad_faces)
        for (unsigned int m = 0; m < face.nodes.size(); ++m)
          if (face.nodes[m].size() == 1)
            found[face.nodes[m][0].equations[dim]] = face.shape.nodes[m];
      std::vector<MultiplierNode<dim>> nodes;
      for (const auto &[equation, x] : found)
        nodes.push_back({equation, x});
      return nodes;
    }

    /// The values of the pad's multiplier shape functions at a point of the contact face, by
    /// equation.
    template <int dim>
    std::map<int, double> shape_values(const Contact<dim> &contact, const Point<dim> &x)
    {
      const FaceElement<dim> &element = contact.face_element();
      double least                    = 1e300;
      std::map<int, double> result;
      for (const ContactFace<dim> &face : contact.paired_interfaces()[0].pad_faces)
      {
        const auto xi  = element.project(face.shape, x);
        double outside = 0;
        for (unsigned int d = 0; d < dim - 1; ++d)
          outside = std::max({outside, -xi[d], xi[d] - 1});
        if (outside >= least)
          continue;
        least = outside;
        std::vector<double> values;
        element.evaluate(xi, values);
        result.clear();
        for (unsigned int m = 0; m < values.size(); ++m)
          for (const FreeNode<dim> &node : face.nodes[m])
            result[node.equations[dim]] += node.weight * values[m];
      }
      return result;
    }

    /// One mesh with its multipliers and the operator B A^{-1} B^T on columns of multipliers.
    template <int dim>
    struct Level
    {
      FiniteElementSpace<dim> spaces;
      std::unique_ptr<Contact<dim>> contact;
      std::vector<MultiplierNode<dim>> nodes;

      Level(const Geometry<dim> &geometry, const unsigned int degree,
            const unsigned int refinements)
          : spaces(geometry, degree, true, MPI_COMM_WORLD)
      {
        if (refinements > 0)
          spaces.triangulation.refine_global(refinements);
        spaces.distribute();
        ContactModel<dim> model;
        contact = std::make_unique<Contact<dim>>(spaces, model);
        nodes   = multiplier_nodes(*contact);
      }

      /// L^T B A^{-1} B^T L for the columns of L, given at the multiplier nodes.
      DenseMatrix compliance(const DenseMatrix &columns, const Material &rotor_material,
                             const Material &pad_material, const double omega) const
      {
        const BodyMatrices rotor = assemble_body(spaces, {rotor_body}, rotor_material, false);
        const BodyMatrices pad   = assemble_body(spaces, {upper_pad_body}, pad_material, false);
        std::vector<Entry> ones;
        for (const auto &node : nodes)
          ones.push_back({unsigned(node.equation), unsigned(node.equation), 1e9});
        const Matrix identity = matrix_of(spaces.rows, ones);
        const double w2       = omega * omega;
        const Matrix A =
            sum_of(spaces.rows,
                   {{1., *rotor.K}, {1., *pad.K}, {w2, *rotor.M}, {w2, *pad.M}, {1., identity}});
        MultiVector l(spaces.rows, columns.n_columns);
        for (unsigned int j = 0; j < columns.n_columns; ++j)
          for (unsigned int i = 0; i < nodes.size(); ++i)
            l.column(j)[nodes[i].equation] = columns(i, j);
        const MultiVector forces = multiply(normal_matrix(*contact), l);
        const Factorization factorization(A, Factorization::Kind::lu, "the norm");
        return inner_products(forces, factorization.solve(forces));
      }
    };

    /// The smallest eigenvalue of S x = t T x, S symmetric, T > 0.
    double smallest_ratio(const DenseMatrix &S, DenseMatrix T)
    {
      const unsigned int n             = S.n_rows;
      const std::vector<double> values = symmetric_eigen(T); // T is now V, T = V D V^T
      DenseMatrix scaled(n, n);
      for (unsigned int j = 0; j < n; ++j)
        for (unsigned int i = 0; i < n; ++i)
          scaled(i, j) = T(i, j) / std::sqrt(values[j]);
      DenseMatrix both = symmetrised(scaled.transpose() * S * scaled);
      return symmetric_eigen(both)[0];
    }

    /// beta. V_f has @p more_degrees more degrees and @p refinements more refinements.
    template <int dim>
    double inf_sup(const Geometry<dim> &geometry, const unsigned int degree, const double E_r,
                   const double E_p, const unsigned int more_degrees,
                   const unsigned int refinements)
    {
      const Level<dim> coarse(geometry, degree, 0),
          fine(geometry, degree + more_degrees, refinements);
      const unsigned int n = coarse.nodes.size();
      std::map<int, unsigned int> column_of;
      for (unsigned int i = 0; i < n; ++i)
        column_of[coarse.nodes[i].equation] = i;
      DenseMatrix prolongation(fine.nodes.size(), n);
      for (unsigned int i = 0; i < fine.nodes.size(); ++i)
        for (const auto &[equation, value] : shape_values(*coarse.contact, fine.nodes[i].x))
          prolongation(i, column_of.at(equation)) += value;

      const Material rotor{E_r, 0.25, 7200, 0, 0}, pad{E_p, 0.3, 2500, 0, 0};
      const double omega = 2 * M_PI * 6000;
      const double beta_2 =
          smallest_ratio(coarse.compliance(DenseMatrix::identity(n), rotor, pad, omega),
                         fine.compliance(prolongation, rotor, pad, omega));
      return std::sqrt(beta_2);
    }

    /// A block of 0.05 x 0.02 on a layer of 0.1 x 0.02.
    Geometry<2> make_case(const unsigned int n_rotor, const unsigned int n_pad,
                          const unsigned int n_y)
    {
      Parameters::All prm;
      prm.strip.length               = 0.1;
      prm.strip.thickness            = 0.02;
      prm.strip.block_length         = 0.05;
      prm.strip.block_thickness      = 0.02;
      prm.discretization.rotor_cells = {{1, n_rotor, n_y}};
      prm.discretization.pad_cells   = {{1, n_pad, n_y}};
      return make_strip(prm);
    }

    /// The tables are shown on demand: SQUEAL_TABLES=1 unit_tests -tc="inf_sup*"
    bool show_tables()
    {
      return std::getenv("SQUEAL_TABLES") != nullptr;
    }
  } // namespace

  // Measured beta, brake's materials (all degrees, three meshes): 0.76 to 0.82 matching and rotor
  // finer, 0.66 to 0.69 pad finer; a pad 12.5 times as stiff as the rotor and finer: 0.19 to 0.23.
  TEST_CASE("inf_sup: strip, degrees 1 to 4, three meshes each" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    if (n_ranks() > 1) // the measurement replicates nothing
      return;
    struct Mesh
    {
      const char *name;
      unsigned int rotor, pad; // cells on the coarsest mesh
    };
    struct Materials
    {
      const char *name;
      double rotor, pad;
      unsigned int max_degree; // in the test; all four in the tables
    };
    if (show_tables())
      std::printf("materials          mesh            degree   beta on three meshes\n");
    for (const Materials &E :
         {Materials{"brake, pad softer", E_rotor, E_pad, 4}, Materials{"equal", E_pad, E_pad, 1},
          Materials{"pad stiffer", E_pad, E_rotor, 2}})
      for (const Mesh &mesh :
           {Mesh{"matching", 4, 2}, Mesh{"rotor finer", 7, 2}, Mesh{"pad finer", 4, 5}})
        for (unsigned int degree = 1; degree <= (show_tables() ? 4 : E.max_degree); ++degree)
        {
          CAPTURE(E.name);
          CAPTURE(mesh.name);
          CAPTURE(degree);
          std::vector<double> beta;
          for (const unsigned int n : {1, 2, 4})
            beta.push_back(
                inf_sup(make_case(n * mesh.rotor, n * mesh.pad, n), degree, E.rotor, E.pad, 2, 1));
          if (show_tables())
            std::printf("%-18s %-14s %7u   %6.3f %6.3f %6.3f\n", E.name, mesh.name, degree, beta[0],
                        beta[1], beta[2]);
          for (const double value : beta)
          {
            if (E.rotor >= E.pad)
              CHECK(value > 0.3);
            // The pad's share of the compliance, whatever the rotor sees.
            CHECK(value > 0.65 * std::sqrt(E.rotor / (E.rotor + E.pad)));
            CHECK(value <= 1 + 1e-8);
          }
          // It does not decay under refinement.
          CHECK(beta[2] > 0.95 * beta[0]);
          CHECK(beta[2] > 0.98 * beta[1]);
        }
  }

  TEST_CASE("inf_sup: the norm is nearly exact" * doctest::test_suite("slow, one rank"))
  {
    // A further refinement of V_f changes little.
    if (n_ranks() > 1)
      return;
    for (const unsigned int n_pad : {4, 10})
      for (const unsigned int degree : {1, 2})
      {
        CAPTURE(n_pad);
        CAPTURE(degree);
        const Geometry<2> geometry = make_case(8, n_pad, 2);
        const double once          = inf_sup(geometry, degree, E_rotor, E_pad, 2, 1),
                     twice         = inf_sup(geometry, degree, E_rotor, E_pad, 2, 2);
        if (show_tables())
          std::printf("V_f refined once: beta %.4f, twice: %.4f\n", once, twice);
        CHECK(relative_error(once, twice) <= 0.02);
      }
  }

  TEST_CASE("inf_sup: blocks, degrees 1 and 2, two meshes each" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    if (n_ranks() > 1)
      return;
    using Cells = std::array<unsigned int, 3>;
    struct Mesh
    {
      const char *name;
      Cells rotor, pad;
    };
    if (show_tables())
      std::printf("blocks: mesh       degree   beta on two meshes\n");
    for (const Mesh &mesh :
         {Mesh{"matching", {{1, 2, 1}}, {{1, 2, 1}}}, Mesh{"rotor finer", {{2, 3, 1}}, {{1, 2, 1}}},
          Mesh{"pad finer", {{1, 2, 1}}, {{2, 3, 1}}}})
      for (const unsigned int degree : {1, 2})
      {
        CAPTURE(mesh.name);
        CAPTURE(degree);
        std::vector<double> beta;
        for (const unsigned int n : {1, 2})
        {
          const auto finer = [&](const Cells &cells) {
            return Cells{{n * cells[0], n * cells[1], cells[2]}};
          };
          beta.push_back(inf_sup(make_blocks(finer(mesh.rotor), finer(mesh.pad)), degree, E_rotor,
                                 E_pad, 1, 1));
        }
        if (show_tables())
          std::printf("%-17s %7u   %6.3f %6.3f\n", mesh.name, degree, beta[0], beta[1]);
        for (const double value : beta)
        {
          CHECK(value > 0.3);
          CHECK(value <= 1 + 1e-3); // the refined face is not exactly the coarse one
        }
        CHECK(beta[1] > 0.9 * beta[0]);
      }
  }
} // namespace squeal::tests::inf_sup_tests

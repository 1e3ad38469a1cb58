#include "statics.h"

#include <doctest/doctest.h>

#include <squeal/contact/contact_matrices.h>
#include <squeal/eigen/eigensolvers.h>

#include <cstdio>
#include <cstdlib>
namespace squeal::tests::contact_convergence_tests
{
  using namespace dealii;

  // Rates of convergence where nothing is singular, and the limit of penalty.
  //
  // A layer on a fixed base carries a second layer of the same length; both are periodic in x, so
  // there are no corners. The upper layer is guided on its back and pressed by p (1 + cos(k x)/2).
  // Contact is closed, its pressure smooth. On matching meshes degree p gives errors h^{2p} in the
  // eigenvalues and in the compliance F^T u, the work of the load. Question 1: is this so on
  // non-matching meshes, too?
  //
  // Penalty, p = k_C g, acts in every quadrature point. Its limit is [[u]].n = 0 in every point,
  // which on non-matching meshes leaves only what both trace spaces contain: the face locks. A
  // penalty of the projected gap,
  //     int Psi (p / k_C - [[u]].n) = 0,   p = Psi^T Lambda,
  // is the saddle point with -1/k_C times the mass matrix of the multipliers in the corner, and
  // tends to mortar. Question 2: is this so?

  namespace
  {
    bool show_tables()
    {
      return std::getenv("SQUEAL_TABLES") != nullptr;
    }

    const double length = 0.2;

    Geometry<2> make_layers(const unsigned int n_rotor, const unsigned int n_pad,
                            const unsigned int n_y)
    {
      Parameters::All prm;
      prm.strip.length               = length;
      prm.strip.thickness            = 0.02;
      prm.strip.block_length         = length;
      prm.strip.block_thickness      = 0.02;
      prm.pads.pressure              = p;
      prm.pads.profile               = "cos(31.41592653589793*x)" /* 2 pi x / length */;
      prm.discretization.rotor_cells = {{1, n_rotor, n_y}};
      prm.discretization.pad_cells   = {{1, n_pad, n_y}};
      Geometry<2> geometry           = make_strip(prm);
      // The ends of the upper layer are one, as those of the lower layer.
      const auto side = geometry.boundaries.at("upper_pad.side");
      for (auto &rule : geometry.rules)
        if (rule.id == side)
          rule.id = rule.value < 0 ? geometry.periodic.first : geometry.periodic.second;
      return geometry;
    }

    enum class Coupling
    {
      mortar,
      point_penalty,
      projected_penalty
    };

    /// The layers on one mesh: l^2 M + Q, compliance and eigenfrequencies.
    struct Layers
    {
      const Geometry<2> geometry; // the spaces refer to it
      FiniteElementSpace<2> spaces;
      std::unique_ptr<Contact<2>> contact;
      QuadraticEigenproblem problem;

      Layers(const Geometry<2> &given, const unsigned int degree, const Coupling coupling,
             const double k_C = 1)
          : geometry(given),
            spaces(geometry, degree, coupling != Coupling::point_penalty, MPI_COMM_WORLD)
      {
        spaces.distribute();
        const BodyMatrices rotor = assemble_body(spaces, {rotor_body}, {E_rotor, 0.25, 7200, 0, 0},
                                                 false),
                           pad   = assemble_body(spaces, {upper_pad_body}, {E_pad, 0.3, 2500, 0, 0},
                                                 false);
        ContactModel<2> model;
        model.mortar            = coupling != Coupling::point_penalty;
        model.penalty_stiffness = k_C;
        contact                 = std::make_unique<Contact<2>>(spaces, model);
        if (model.mortar)
          contact->scale_constraints(rotor.K->infinity_norm());
        const Matrix normal = normal_matrix(*contact),
                     corner =
                         coupling == Coupling::projected_penalty ? multiplier_mass() : Matrix();
        const double scale = contact->pressure_scale();
        problem.rows       = spaces.rows;
        problem.M          = sum_of(spaces.rows, {{1., *rotor.M}, {1., *pad.M}});
        problem.Q =
            sum_of(spaces.rows,
                   {{1., *rotor.K}, {1., *pad.K}, {1., normal}, {-scale * scale / k_C, corner}});
        problem.n_constraints       = contact->n_active_multipliers();
        problem.n_local_constraints = spaces.rows.end - spaces.first_local_multiplier;
        problem.may_move_rigidly    = false;
        // Q is symmetric and needs no reference problem to count modes. It is given all the same:
        // known defect, without it the polishing tests with vectors that do not satisfy the
        // constraints once rounding is amplified, and fails on most of these meshes.
        problem.reference      = sum_of(spaces.rows, {{1., problem.Q}});
        problem.reference_name = "itself";
      }

      /// int Psi Psi^T.
      Matrix multiplier_mass() const
      {
        EntryList entries;
        const PairedInterface<2> &interface = contact->paired_interfaces()[0];
        for (const FacePair<2> &pair : interface.pairs)
        {
          const ContactKinematics<2> k(
              contact->face_element(), interface.rotor_faces[pair.rotor_face],
              interface.pad_faces[pair.pad_face], pair, spaces.geometry, 1);
          const DenseMatrix local = k.product(k.psi, k.weights, k.psi);
          for (unsigned int m = 0; m < k.pad->nodes.size(); ++m)
            for (unsigned int n = 0; n < k.pad->nodes.size(); ++n)
              for (const FreeNode<2> &row : k.pad->nodes[m])
                for (const FreeNode<2> &column : k.pad->nodes[n])
                  entries.add(row.equations[2], column.equations[2],
                              row.weight * column.weight * local(m, n));
        }
        return entries.make_matrix(spaces.rows);
      }

      double compliance() const
      {
        const MultiVector load = assemble_pressure_load(spaces);
        const Factorization factorization(problem.Q, Factorization::Kind::lu, "the layers");
        MultiVector u              = factorization.solve(load);
        const MultiVector residual = multiply(problem.Q, u);
        MultiVector rest           = load;
        for (unsigned int i = 0; i < rest.n_local(); ++i)
          rest.column(0)[i] -= residual.column(0)[i];
        const MultiVector correction = factorization.solve(rest);
        return inner_product(load, u) + inner_product(load, correction);
      }

      std::vector<double> frequencies() const
      {
        EigensolverOptions options;
        options.max_imaginary = 2 * M_PI * 42000;
        const EigenPairs modes =
            make_eigensolver(ModeSolver::block_krylov)->solve(problem, options).modes;
        std::vector<double> result;
        for (unsigned int i = 0; i < 8; ++i)
          result.push_back(modes.lambda.at(i).imag());
        return result;
      }
    };

    struct Mesh
    {
      std::string name;
      unsigned int rotor, pad; // cells on the coarsest mesh
    };
    const Mesh meshes[] = {{"matching", 4, 4}, {"rotor finer", 7, 4}, {"pad finer", 4, 7}};

    double largest_error(const std::vector<double> &values, const std::vector<double> &expected)
    {
      double largest = 0;
      for (unsigned int i = 0; i < values.size(); ++i)
        largest = std::max(largest, relative_error(values[i], expected[i]));
      return largest;
    }
  } // namespace

  TEST_CASE("contact_convergence: full order on non-matching meshes" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    if (n_ranks() > 1) // rates do not depend on the ranks
      return;
    const Layers reference(make_layers(12, 12, 3), 7, Coupling::mortar);
    const double compliance               = reference.compliance();
    const std::vector<double> frequencies = reference.frequencies();
    if (show_tables())
      std::printf(
          "degree  mesh          cells of the pad   compliance    rate    8 frequencies    rate\n");
    for (unsigned int degree = 1; degree <= 4; ++degree)
    {
      std::array<double, 2> matching{};
      for (const Mesh &mesh : meshes)
      {
        CAPTURE(degree);
        CAPTURE(mesh.name);
        std::array<double, 2> before{}, error{}, rate{};
        for (unsigned int step = 0; step < 3; ++step)
        {
          const unsigned int n = (degree < 3 ? 2 : 1) << step;
          const Layers layers(make_layers(n * mesh.rotor, n * mesh.pad, n), degree,
                              Coupling::mortar);
          error = {{relative_error(layers.compliance(), compliance),
                    largest_error(layers.frequencies(), frequencies)}};
          for (unsigned int i = 0; i < 2; ++i)
            rate[i] = step == 0 ? 0 : std::log2(before[i] / error[i]);
          if (show_tables())
            std::printf("%6u  %-14s %15u   %10.2e   %5.2f   %14.2e   %5.2f\n", degree,
                        mesh.name.c_str(), n * mesh.pad, error[0], rate[0], error[1], rate[1]);
          before = error;
        }
        if (mesh.rotor == mesh.pad)
          matching = error;
        for (unsigned int i = 0; i < 2; ++i)
        {
          CAPTURE(i);
          // Order 2 p, unless rounding is reached, and no more error than the matching mesh whose
          // cells are as long as the longest of this one.
          if (error[i] > 1e-10)
            CHECK(rate[i] > 2 * degree - 0.4);
          CHECK(error[i] < 1.5 * matching[i] + 1e-10);
        }
      }
    }
  }

  TEST_CASE("contact_convergence: projected penalty tends to mortar, point-wise penalty only if "
            "meshes match" *
            doctest::test_suite("slow, one rank, optimised"))
  {
    if (n_ranks() > 1) // rates do not depend on the ranks
      return;
    const unsigned int degree = 2;
    if (show_tables())
      std::printf("mesh           k_C, N/m^3   compliance against mortar: in points   projected\n");
    for (const Mesh &mesh : meshes)
    {
      CAPTURE(mesh.name);
      const Geometry<2> geometry = make_layers(2 * mesh.rotor, 2 * mesh.pad, 2);
      const double mortar        = Layers(geometry, degree, Coupling::mortar).compliance();
      std::vector<std::array<double, 2>> differences;
      for (int exponent = 13; exponent <= 18; ++exponent)
      {
        const double k_C = std::pow(10., exponent);
        differences.push_back(
            {{relative_error(Layers(geometry, degree, Coupling::point_penalty, k_C).compliance(),
                             mortar),
              relative_error(
                  Layers(geometry, degree, Coupling::projected_penalty, k_C).compliance(),
                  mortar)}});
        if (show_tables())
          std::printf("%-14s       1e%d   %34.2e   %9.2e\n", mesh.name.c_str(), exponent,
                      differences.back()[0], differences.back()[1]);
      }
      // 1/k_C: both where the meshes match, else the projected one only.
      for (unsigned int i = 1; i < differences.size(); ++i)
      {
        CAPTURE(i);
        if (differences[i][1] > 1e-9)
          CHECK(relative_error(differences[i][1] / differences[i - 1][1], 0.1) <= 0.02);
        if (mesh.rotor == mesh.pad && differences[i][0] > 1e-8)
          CHECK(relative_error(differences[i][0] / differences[i - 1][0], 0.1) <= 0.02);
      }
      if (mesh.rotor != mesh.pad)
        CHECK(differences.back()[0] > 1e-4);
    }
  }
} // namespace squeal::tests::contact_convergence_tests

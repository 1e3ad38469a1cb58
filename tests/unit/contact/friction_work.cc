#include "helpers.h"

#include <doctest/doctest.h>

#include <squeal/assessment/stability.h>
#include <squeal/contact/contact_fields.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/model/brake_model.h>
#include <squeal/scenes/make_scene.h>
namespace squeal::tests::friction_work_tests
{
  namespace
  {
    /// A brake whose meshes do not match, with friction that falls, so that every term is there;
    /// part of the pads' faces is open.
    Parameters::All small_brake(const std::string &formulation)
    {
      Parameters::All prm;
      prm.discretization.degree            = 2;
      prm.discretization.rotor_cells       = {{2, 12, 1}};
      prm.discretization.pad_cells         = {{2, 2, 1}};
      prm.contact.formulation              = value_named<Formulation>(formulation);
      prm.contact.friction.kind            = FrictionLaw::Kind::falling;
      prm.contact.friction.coefficient     = 0.5;
      prm.contact.initial_gap              = "5e-6 * (1 + tanh((y - 0.03) / 0.005))";
      prm.eigenproblem.maximum_frequency   = 2500;
      prm.rotor.material.stiffness_damping = 1e-7;
      return prm;
    }

    Parameters::All small_strip()
    {
      Parameters::All prm;
      prm.discretization.degree          = 2;
      prm.scene                          = Scene::strip;
      prm.operation.angular_velocity     = 2;
      prm.contact.friction.kind          = FrictionLaw::Kind::falling;
      prm.discretization.rotor_cells     = {{1, 12, 1}};
      prm.discretization.pad_cells       = {{1, 5, 1}};
      prm.eigenproblem.maximum_frequency = 30000;
      return prm;
    }

    /// For every mode and each of the three causes: the integral of the work over the quadrature
    /// points, the same of the field on the faces, and the sum of the contributions' energies.
    template <int dim>
    void compare(const Geometry<dim> &geometry, const Parameters::All &prm,
                 const double least_share)
    {
      Log log(MPI_COMM_WORLD);
      PhaseTimer timer;
      BrakeModel<dim> model(geometry, prm, MPI_COMM_WORLD, log, timer);
      model.distribute();
      model.assemble(prm);
      const QuadraticEigenproblem problem = model.problem();
      EigensolverOptions options;
      options.max_imaginary  = 2 * M_PI * prm.eigenproblem.maximum_frequency;
      const EigenPairs modes = make_eigensolver(ModeSolver::krylov)->solve(problem, options).modes;
      const RayleighParts d_g_k_n = rayleigh_parts(model, modes);
      const auto rows             = analyse(d_g_k_n, modes, 0, options.tolerance);
      const auto parts            = contributions(d_g_k_n, modes, rows);
      // Summed they are x^H P x and x^H Q x.
      const auto of_sums = analyse(problem, modes, 0, options.tolerance);
      for (unsigned int j = 0; j < rows.size(); ++j)
      {
        const double size = std::abs(of_sums[j].k), rate = std::sqrt(size);
        CHECK(std::abs(rows[j].k - of_sums[j].k) <= 1e-11 * size);
        CHECK(std::abs(rows[j].n - of_sums[j].n) <= 1e-11 * size);
        CHECK(std::abs(rows[j].d - of_sums[j].d) <= 1e-11 * rate);
        CHECK(std::abs(rows[j].g - of_sums[j].g) <= 1e-11 * rate);
      }
      REQUIRE(rows.size() >= 4);

      const Contact<dim> &contact              = *model.contact();
      const std::array<std::string, 3> origins = {{name_of(Origin::friction),
                                                   name_of(Origin::friction_damping),
                                                   name_of(Origin::falling_friction)}};
      std::array<double, 3> largest{};
      double largest_energy = 0;
      for (unsigned int j = 0; j < rows.size(); ++j)
      {
        const auto work                                     = model.friction_work(modes, j);
        const std::array<const ContactPressure *, 3> values = {
            {&work.friction, &work.damping, &work.falling}};
        double size = 0;
        for (const Contribution &part : parts)
          if (part.mode == rows[j].mode)
            size += std::abs(part.energy);
        for (unsigned int part = 0; part < 3; ++part)
        {
          const auto nodal = project_to_faces(contact, *values[part]);
          double at_points = 0, of_field = 0, expected = 0;
          std::vector<double> psi;
          for (unsigned int i = 0; i < nodal.size(); ++i)
          {
            unsigned int q = 0;
            for (const FacePair<dim> &pair : contact.paired_interfaces()[i].pairs)
              for (const PairedPoint<dim> &point : pair.points)
              {
                at_points += point.weight * (*values[part])[i][q++];
                contact.face_element().evaluate(point.xi_pad, psi);
                for (unsigned int a = 0; a < psi.size(); ++a)
                  of_field += point.weight * psi[a] * nodal[i][pair.pad_face][a];
              }
          }
          at_points = dealii::Utilities::MPI::sum(at_points, MPI_COMM_WORLD);
          of_field  = dealii::Utilities::MPI::sum(of_field, MPI_COMM_WORLD);
          for (const Contribution &c : parts)
            if (c.mode == rows[j].mode && c.origin == origins[part])
              expected += c.energy;
          CAPTURE(j);
          CAPTURE(origins[part]);
          CHECK(std::abs(at_points - expected) <= 1e-8 * std::abs(expected) + 1e-13 * size);
          CHECK(std::abs(of_field - at_points) <= 1e-8 * std::abs(expected) + 1e-13 * size);
          largest[part]  = std::max(largest[part], std::abs(expected));
          largest_energy = std::max(largest_energy, size);
        }
      }
      // None of the three is compared with zero only.
      for (unsigned int part = 0; part < 3; ++part)
        if (dim == 3 || part != 1)
          CHECK(largest[part] > least_share * largest_energy);
    }
  } // namespace

  TEST_CASE("friction work: its integral is the contributions' energy" *
            doctest::test_suite("slow, two ranks at most, optimised"))
  {
    // -pi (d w + n) with d + j g = u^H P u and k + j n = u^H Q u of the friction's matrices is the
    // integral over the surface of what theory.md, section 3, puts under the integral: two ways
    // through the code, by matrices and by points. Faces' fields keep the integral.
    for (const std::string formulation : {"mortar", "mortar_penalty", "penalty"})
    {
      CAPTURE(formulation);
      const Parameters::All prm = small_brake(formulation);
      compare<3>(make_brake(prm), prm, 1e-6);
    }
    const Parameters::All prm = small_strip();
    compare<2>(make_strip(prm), prm, 1e-6);
  }

  TEST_CASE("friction work: the projection onto faces reproduces their own polynomials" *
            doctest::test_suite("slow"))
  {
    // x and y are in the span of the shape functions of an isoparametric face.
    const Parameters::All prm = small_brake("mortar");
    Log log(MPI_COMM_WORLD);
    PhaseTimer timer;
    BrakeModel<3> model(make_brake(prm), prm, MPI_COMM_WORLD, log, timer);
    model.distribute();
    const Contact<3> contact(model.spaces(), ContactModel<3>());
    const auto value = [](const dealii::Point<3> &x) { return 2 + 30 * x[0] - 50 * x[1]; };
    ContactPressure values;
    for (const PairedInterface<3> &interface : contact.paired_interfaces())
    {
      values.emplace_back();
      for (const FacePair<3> &pair : interface.pairs)
        for (const PairedPoint<3> &point : pair.points)
          values.back().push_back(
              value(contact.face_element()
                        .frame(interface.pad_faces[pair.pad_face].shape, point.xi_pad)
                        .x));
    }
    const auto nodal    = project_to_faces(contact, values);
    unsigned int n_seen = 0;
    for (unsigned int i = 0; i < nodal.size(); ++i)
      for (unsigned int f = 0; f < nodal[i].size(); ++f)
        for (unsigned int a = 0; a < nodal[i][f].size(); ++a, ++n_seen)
          CHECK(std::abs(nodal[i][f][a] -
                         value(contact.paired_interfaces()[i].pad_faces[f].shape.nodes[a])) <=
                1e-9);
    CHECK(dealii::Utilities::MPI::sum(n_seen, MPI_COMM_WORLD) == 2 * 4 * 9);
  }
} // namespace squeal::tests::friction_work_tests

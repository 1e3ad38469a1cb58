#include "fields.h"

#include <doctest/doctest.h>

#include <squeal/bars/surface_vectors.h>
#include <squeal/contact/contact.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>

#include <optional>
namespace squeal::tests::contact_tests
{
  using namespace dealii;

  namespace
  {
    /// A free rotor and free pads, 22.5 degrees of arc per rotor cell against 16.7 per pad cell.
    struct ContactScene
    {
      ContactScene(const std::string &arrangement, const bool mortar, const unsigned int degree,
                   const double omega = 4)
          : prm(parameters(arrangement)), geometry(make_brake(prm)),
            spaces(geometry, degree, mortar, MPI_COMM_WORLD)
      {
        spaces.distribute();
        model.mortar               = mortar;
        model.penalty_stiffness    = 1e9;
        model.friction.coefficient = mu;
        model.angular_velocity     = omega;
      }

      static Parameters::All parameters(const std::string &arrangement)
      {
        Parameters::All p;
        p.rotor.clamped              = Clamped::none;
        p.pads.arrangement           = value_named<Arrangement>(arrangement);
        p.pads.back_face             = BackFace::free;
        p.discretization.rotor_cells = {{2, 16, 1}};
        p.discretization.pad_cells   = {{1, 3, 1}};
        return p;
      }

      const Contact<3> &contact()
      {
        if (!interfaces)
          interfaces.emplace(spaces, model);
        return *interfaces;
      }

      template <typename Field>
      MultiVector on_rotor(const Field &field) const
      {
        return interpolate(spaces, {rotor_body}, field);
      }

      /// The rotor's nodes displaced axially by the value of a function.
      template <typename Function>
      MultiVector axially(const Function &function) const
      {
        return on_rotor([&](const Point<3> &x) { return Tensor<1, 3>({0., 0., function(x)}); });
      }

      Parameters::All prm;
      Geometry<3> geometry;
      FiniteElementSpace<3> spaces;
      ContactModel<3> model;
      std::optional<Contact<3>> interfaces;

      static constexpr double mu = 0.4, a = 0.09, b = 0.14, angle = 50 * M_PI / 180;
    };

    // Integrals over the sector a < r < b, |phi| < angle/2.
    const double area = ContactScene::angle / 2 *
                        (ContactScene::b * ContactScene::b - ContactScene::a * ContactScene::a);
    /// int r dA
    const double first_moment =
        ContactScene::angle / 3 * (std::pow(ContactScene::b, 3) - std::pow(ContactScene::a, 3));
    /// int x dA
    const double x_moment = 2. / 3 * std::sin(ContactScene::angle / 2) *
                            (std::pow(ContactScene::b, 3) - std::pow(ContactScene::a, 3));
    /// int cos^2 phi dphi, int cos phi dphi
    const double cos_squared = (ContactScene::angle + std::sin(ContactScene::angle)) / 2,
                 cosine      = 2 * std::sin(ContactScene::angle / 2);

    /// int f(r) dr over the width of the pad
    template <typename Function>
    double over_radius(const Function &f)
    {
      const QGauss<1> rule(10);
      double sum = 0;
      for (unsigned int q = 0; q < rule.size(); ++q)
        sum += rule.weight(q) * (ContactScene::b - ContactScene::a) *
               f(ContactScene::a + (ContactScene::b - ContactScene::a) * rule.point(q)[0]);
      return sum;
    }

    Tensor<1, 3> rotation(const Point<3> &x)
    {
      return Tensor<1, 3>({-x[1], x[0], 0.});
    }

    /// mu T; the pressure is of no effect on Coulomb friction.
    Matrix friction_of(const Contact<3> &contact)
    {
      return friction_matrix(contact, contact.uniform_pressure(1e6));
    }

    Matrix transposed(const Matrix &matrix)
    {
      Mat transpose = nullptr;
      SQUEAL_PETSC(MatTranspose(matrix, MAT_INITIAL_MATRIX, &transpose));
      return Matrix(transpose);
    }

    /// The eigenvalues of a symmetric matrix of which few rows are not empty.
    std::vector<double> eigenvalues_of_few_rows(const RowRange &rows, const Matrix &matrix)
    {
      std::vector<double> is_used(rows.size);
      for (unsigned int row = rows.begin; row < rows.end; ++row)
      {
        PetscInt n = 0;
        SQUEAL_PETSC(MatGetRow(matrix, row, &n, nullptr, nullptr));
        is_used[row] = n > 0;
        SQUEAL_PETSC(MatRestoreRow(matrix, row, &n, nullptr, nullptr));
      }
      MPI_Allreduce(MPI_IN_PLACE, is_used.data(), rows.size, MPI_DOUBLE, MPI_SUM, rows.comm);
      std::vector<unsigned int> used;
      for (unsigned int row = 0; row < rows.size; ++row)
        if (is_used[row] > 0)
          used.push_back(row);
      const MultiVector units = block_of(rows, used.size(),
                                         [&](const unsigned int i, const unsigned int j)
                                         { return i == used[j] ? 1. : 0.; });
      DenseMatrix small       = inner_products(units, multiply(matrix, units));
      return symmetric_eigen(small);
    }

    /// The error of arcs of 16.7 degrees of this degree.
    double arc_error(const unsigned int degree)
    {
      return degree == 2 ? 3e-5 : 1e-7;
    }
  } // namespace

  TEST_CASE("contact: virtual work of the normal coupling, mortar")
  {
    // c^T N u = int p [[u]].n for the constant pressure p = 1: the area for a rotor that rises
    // towards the upper pad, int x dA if it tilts; with both pads twice that if it swells.
    for (const unsigned int degree : {2u, 3u})
    {
      CAPTURE(degree);
      ContactScene scene("upper", true, degree);
      const Matrix N             = normal_matrix(scene.contact());
      const MultiVector pressure = constant_multiplier(scene.spaces, 1);
      const auto work        = [&](const MultiVector &u) { return bilinear_form(pressure, N, u); };
      const MultiVector rise = translation(scene.spaces, {rotor_body}, 2);
      CHECK(relative_error(work(rise), area) <= arc_error(degree));
      // Exactly the area of the pad's face as it is meshed.
      const double meshed_area =
          integrate_boundary(scene.spaces, scene.geometry.boundaries.at("upper_pad.contact"),
                             [](const Point<3> &, const Tensor<1, 3> &) { return 1.; });
      CHECK(relative_error(work(rise), meshed_area) <= 1e-12);
      CHECK(relative_error(work(scene.axially([](const Point<3> &x) { return x[0]; })), x_moment) <=
            arc_error(degree));
      // The pad moving away does the same work; in-plane motions do none; neither does what all
      // bodies share.
      CHECK(relative_error(work(translation(scene.spaces, {upper_pad_body}, 2)), -meshed_area) <=
            1e-12);
      CHECK(std::abs(work(translation(scene.spaces, {rotor_body}, 0))) <= 1e-14 * area);
      CHECK(largest_entry(multiply(N, translation(scene.spaces, all_bodies, 2))) <=
            1e-14 * N.infinity_norm());
      CHECK(asymmetry(scene.spaces.rows, N) <= 1e-15);
    }

    ContactScene both("both", true, 2);
    const Matrix N = normal_matrix(both.contact());
    const MultiVector swell =
        both.axially([&](const Point<3> &x) { return x[2] / (both.prm.rotor.thickness / 2); });
    CHECK(relative_error(bilinear_form(constant_multiplier(both.spaces, 1), N, swell), 2 * area) <=
          arc_error(2));
  }

  TEST_CASE("contact: pressure_scale multiplies the mortar matrices")
  {
    ContactScene scene("upper", true, 2);
    Contact<3> contact(scene.spaces, scene.model);
    const auto pressure   = contact.uniform_pressure(1e6);
    const double normal   = normal_matrix(contact).infinity_norm(),
                 friction = friction_matrix(contact, pressure).infinity_norm();
    CHECK(contact.pressure_scale() == 1);
    for (const double factor : {10., 1e3}) // not cumulative
    {
      contact.scale_constraints(factor * normal);
      CHECK(relative_error(contact.pressure_scale(), factor) <= 1e-14);
      CHECK(relative_error(normal_matrix(contact).infinity_norm(), factor * normal) <= 1e-14);
      CHECK(relative_error(friction_matrix(contact, pressure).infinity_norm(), factor * friction) <=
            1e-14);
    }
  }

  TEST_CASE("contact: virtual work of the normal coupling, penalty")
  {
    // v^T N u = k_C int ([[v]].n) ([[u]].n): k_C A for unit translations, for tilts k_C int x dA
    // with a translation.
    ContactScene scene("both", false, 3);
    const double k_C       = scene.model.penalty_stiffness;
    const Matrix N         = normal_matrix(scene.contact());
    const MultiVector rise = translation(scene.spaces, {rotor_body}, 2);
    const MultiVector tilt = scene.axially([](const Point<3> &x) { return x[0]; });
    CHECK(relative_error(bilinear_form(rise, N, rise), 2 * k_C * area) <= 1e-7);
    CHECK(relative_error(bilinear_form(rise, N, tilt), 2 * k_C * x_moment) <= 1e-7);
    CHECK(largest_entry(multiply(N, translation(scene.spaces, all_bodies, 2))) <=
          1e-13 * N.infinity_norm());
    CHECK(asymmetry(scene.spaces.rows, N) <= 1e-15);
    // A unit translation of one pad meets the rotor on that side only.
    const MultiVector upper = translation(scene.spaces, {upper_pad_body}, 2);
    CHECK(relative_error(bilinear_form(upper, N, rise), -k_C * area) <= 1e-7);
  }

  TEST_CASE("contact: virtual work of the friction")
  {
    // v^T (mu T) p = mu p int [[v]].e with e = e_phi: for a rotating rotor int r dA, the torque, on
    // both pads; for a translation along y, int cos phi dA; along x, 0 by symmetry. What all bodies
    // share does no work (action equals reaction), in any column.
    for (const double omega : {4., 0., -4.})
    {
      CAPTURE(omega);
      const double sign = omega < 0 ? -1 : 1; // friction opposes the motion
      {
        ContactScene scene("both", true, 3, omega);
        const Matrix T             = friction_of(scene.contact());
        const MultiVector pressure = constant_multiplier(scene.spaces, 1);
        const auto work = [&](const MultiVector &v) { return bilinear_form(v, T, pressure); };
        CHECK(relative_error(work(scene.on_rotor(rotation)),
                             sign * ContactScene::mu * 2 * first_moment) <= 1e-7);
        const double along_y =
            ContactScene::mu *
            (ContactScene::b * ContactScene::b - ContactScene::a * ContactScene::a) * cosine;
        CHECK(relative_error(work(translation(scene.spaces, {rotor_body}, 1)), sign * along_y) <=
              1e-7);
        CHECK(relative_error(work(translation(scene.spaces, {upper_pad_body}, 1)),
                             -sign * along_y / 2) <= 1e-7);
        CHECK(std::abs(work(translation(scene.spaces, {rotor_body}, 0))) <= 1e-13 * along_y);
        CHECK(std::abs(work(translation(scene.spaces, {rotor_body}, 2))) <= 1e-13 * along_y);
        for (unsigned int c = 0; c < 3; ++c)
          CHECK(largest_entry(multiply(transposed(T), translation(scene.spaces, all_bodies, c))) <=
                1e-14 * T.infinity_norm());
        // No friction force in the rows of the constraints.
        CHECK(std::abs(bilinear_form(pressure, T, scene.on_rotor(rotation))) == 0);
      }
      {
        ContactScene scene("upper", false, 3, omega);
        const Matrix T         = friction_of(scene.contact());
        const MultiVector rise = translation(scene.spaces, {rotor_body}, 2);
        CHECK(relative_error(bilinear_form(scene.on_rotor(rotation), T, rise),
                             sign * ContactScene::mu * scene.model.penalty_stiffness *
                                 first_moment) <= 1e-7);
        CHECK(std::abs(bilinear_form(rise, T, scene.on_rotor(rotation))) <=
              1e-13 * area * scene.model.penalty_stiffness);
      }
    }
  }

  TEST_CASE("contact: resultants of the uniform pressure")
  {
    // Force p A, friction force mu p A, torque mu p int r dA = mu p angle (b^3 - a^3)/3.
    const double p = 2e5;
    for (const bool mortar : {true, false})
    {
      ContactScene scene("both", mortar, 3);
      const auto &contact = scene.contact();
      const auto results  = resultants(contact, contact.uniform_pressure(p), nullptr);
      CHECK(results.size() == 2);
      CHECK(results[0].name == "upper");
      CHECK(results[1].name == "lower");
      for (const ContactResultants &r : results)
      {
        CHECK(relative_error(r.area, area) <= 1e-7);
        CHECK(relative_error(r.normal_force, p * area) <= 1e-7);
        CHECK(relative_error(r.friction_force, ContactScene::mu * p * area) <= 1e-7);
        CHECK(relative_error(r.friction_torque, ContactScene::mu * p * first_moment) <= 1e-7);
        CHECK(r.max_pressure == p);
        CHECK(r.min_pressure == 0);
      }
    }

    // A falling law sees the speed Omega r at each radius: torque p angle int mu(Omega r) r^2 dr.
    ContactScene scene("upper", true, 3);
    scene.model.friction.kind               = FrictionLaw::Kind::falling;
    scene.model.friction.coefficient_moving = 0.1;
    scene.model.friction.decay_speed        = 0.3;
    const auto &contact                     = scene.contact();
    const auto result = resultants(contact, contact.uniform_pressure(p), nullptr)[0];
    const auto mu     = [&](const double r) { return 0.1 + 0.3 * std::exp(-4 * r / 0.3); };
    CHECK(relative_error(result.friction_torque,
                         p * ContactScene::angle *
                             over_radius([&](const double r) { return mu(r) * r * r; })) <= 1e-7);
    CHECK(relative_error(result.friction_force,
                         p * ContactScene::angle *
                             over_radius([&](const double r) { return mu(r) * r; })) <= 1e-7);
    // And so does the matrix.
    CHECK(relative_error(bilinear_form(scene.on_rotor(rotation),
                                       friction_matrix(contact, contact.uniform_pressure(p)),
                                       constant_multiplier(scene.spaces, p)),
                         result.friction_torque) <= 1e-12);
  }

  TEST_CASE("contact: kept matrices are those of the present model and contacts")
  {
    // With another friction coefficient neither N nor T is assembled again; with another speed of a
    // law that depends on it, another scale, or released contacts they are.
    ContactScene scene("upper", true, 2);
    Contact<3> contact(scene.spaces, scene.model);
    ContactModel<3> model = scene.model;
    ContactMatrices<3> kept;
    const auto pressure      = contact.uniform_pressure(1e6);
    const auto is_as_present = [&]()
    {
      const auto [factor, T] = kept.friction(contact, pressure);
      const Matrix fresh = friction_matrix(contact, pressure), normal = normal_matrix(contact),
                   difference = sum_of(scene.spaces.rows, {{factor, *T}, {-1., fresh}}),
                   of_normal =
                       sum_of(scene.spaces.rows, {{1., *kept.normal(contact)}, {-1., normal}});
      return difference.infinity_norm() <= 1e-14 * fresh.infinity_norm() &&
             of_normal.infinity_norm() <= 1e-14 * normal.infinity_norm();
    };
    CHECK(is_as_present());
    const auto T = kept.friction(contact, pressure).second, N = kept.normal(contact);
    model.friction.coefficient *= 3;
    contact.set_model(model);
    CHECK(is_as_present());
    CHECK(kept.friction(contact, pressure).second == T);
    CHECK(kept.normal(contact) == N);

    model.friction.kind               = FrictionLaw::Kind::falling;
    model.friction.coefficient_moving = 0.1;
    model.friction.decay_speed        = 1;
    contact.set_model(model);
    CHECK(is_as_present());
    CHECK(kept.friction(contact, pressure).second != T);
    contact.scale_constraints(1e3 * normal_matrix(contact).infinity_norm());
    CHECK(is_as_present());
    // A state of tension releases what carries it.
    contact.update_active_set(constant_multiplier(scene.spaces, -1));
    REQUIRE(contact.n_active_multipliers() == 0);
    CHECK(is_as_present());
  }

  TEST_CASE("contact: the pressure of a state")
  {
    // Mortar: multipliers times pressure_scale. Penalty: k_C times penetration, here of a rotor
    // risen by 1e-6 m.
    {
      ContactScene scene("upper", true, 3);
      Contact<3> contact(scene.spaces, scene.model);
      contact.scale_constraints(100 * normal_matrix(contact).infinity_norm());
      const MultiVector state = constant_multiplier(scene.spaces, 7);
      const auto result       = resultants(contact, contact.pressure_of(state), &state)[0];
      CHECK(relative_error(result.max_pressure, 700) <= 1e-12);
      CHECK(relative_error(result.normal_force, 700 * area) <= 1e-7);
      CHECK(std::abs(result.max_penetration) <= 1e-20);
      // Negative multipliers are tension: computed, until the active set releases them.
      const auto tension = resultants(
          contact, contact.pressure_of(constant_multiplier(scene.spaces, -7)), nullptr)[0];
      CHECK(relative_error(tension.min_pressure, -700) <= 1e-12);
      CHECK(tension.max_pressure == 0);
      CHECK(relative_error(tension.normal_force, -700 * area) <= 1e-7);
    }
    {
      ContactScene scene("both", false, 3);
      const auto &contact = scene.contact();
      const MultiVector state =
          scene.axially([&](const Point<3> &x) { return x[2] > 0 ? 1e-6 : -3e-6; });
      const auto results = resultants(contact, contact.pressure_of(state), &state);
      for (const unsigned int i : {0u, 1u})
      {
        const double depth = i == 0 ? 1e-6 : 3e-6, p = scene.model.penalty_stiffness * depth;
        CHECK(relative_error(results[i].max_penetration, depth) <= 1e-12);
        CHECK(relative_error(results[i].max_pressure, p) <= 1e-12);
        CHECK(relative_error(results[i].friction_torque, ContactScene::mu * p * first_moment) <=
              1e-7);
      }
    }
  }

  TEST_CASE("contact: friction damping of the turning direction")
  {
    // P_R: int (mu p/(|Omega| r)) ([[v]].b)([[u]].b) with b = -+e_r. For u = v = e_x on the rotor:
    //   (mu p/|Omega|) int int cos^2 phi dphi dr. The pads feel the same, so that motions of all
    //   bodies feel nothing.
    // Q_R: int (mu p/(|Omega| r)) Omega ([[v]].b)(d_phi u.b): with v = e_x, u = y e_x, d_phi y = x
    // = r cos phi:
    //   sign(Omega) mu p int int cos^3 phi r dphi dr, int cos^3 = 2 (s - s^3/3) with s =
    //   sin(angle/2).
    const double p = 3e5, s = std::sin(ContactScene::angle / 2);
    for (const bool mortar : {true, false})
      for (const double omega : {4., -0.5})
      {
        CAPTURE(omega);
        ContactScene scene("both", mortar, 3, omega);
        const auto &contact       = scene.contact();
        const auto damping        = friction_damping(contact, contact.uniform_pressure(p));
        const MultiVector along_x = translation(scene.spaces, {rotor_body}, 0);
        const double expected     = ContactScene::mu * p / std::abs(omega) *
                                (ContactScene::b - ContactScene::a) * cos_squared;
        CHECK(relative_error(bilinear_form(along_x, damping.P, along_x), 2 * expected) <= 1e-6);
        const MultiVector of_pad = translation(scene.spaces, {lower_pad_body}, 0);
        CHECK(relative_error(bilinear_form(of_pad, damping.P, along_x), -expected) <= 1e-6);
        // The sliding direction and the normal one are not damped: the rotation w, and the axial
        // translation.
        CHECK(largest_entry(multiply(damping.P, scene.on_rotor(rotation))) <=
              1e-7 * damping.P.infinity_norm());
        CHECK(largest_entry(multiply(damping.P, translation(scene.spaces, {rotor_body}, 2))) <=
              1e-13 * damping.P.infinity_norm());
        for (unsigned int c = 0; c < 3; ++c)
          CHECK(largest_entry(multiply(damping.P, translation(scene.spaces, all_bodies, c))) <=
                1e-13 * damping.P.infinity_norm());
        CHECK(asymmetry(scene.spaces.rows, damping.P) <= 1e-15);

        const MultiVector shear = scene.on_rotor(
            [](const Point<3> &x) {
              return Tensor<1, 3>({x[1], 0., 0.});
            });
        const double q = ContactScene::mu * p *
                         (ContactScene::b * ContactScene::b - ContactScene::a * ContactScene::a) /
                         2 * 2 * (s - s * s * s / 3);
        CHECK(relative_error(bilinear_form(along_x, damping.Q, shear), (omega < 0 ? -2 : 2) * q) <=
              1e-6);
        CHECK(relative_error(bilinear_form(of_pad, damping.Q, shear), (omega < 0 ? 1 : -1) * q) <=
              1e-6);
        // Only the rotor is transported, and a translation is not changed by it.
        CHECK(largest_entry(multiply(damping.Q, of_pad)) == 0);
        CHECK(largest_entry(multiply(damping.Q, along_x)) <= 1e-13 * damping.Q.infinity_norm());

        CHECK_FALSE(bool(damping.P_falling));
        CHECK_FALSE(bool(damping.Q_falling));
      }
  }

  TEST_CASE("contact: products applied to vectors are those of the matrices")
  {
    // On three ranks as well: pads' faces are shared among them, the rotor's rows are others'.
    for (const bool mortar : {true, false})
    {
      CAPTURE(mortar);
      ContactScene scene("both", mortar, 2);
      scene.model.compliance                  = 1e-12;
      scene.model.friction.kind               = FrictionLaw::Kind::falling;
      scene.model.friction.coefficient_moving = 0.1;
      scene.model.friction.decay_speed        = 0.3;
      Contact<3> contact                      = scene.contact();
      const RowRange &rows                    = scene.spaces.rows;
      const std::vector<unsigned int> all     = contact.multipliers();
      std::vector<unsigned int> released;
      for (unsigned int k = 0; k < all.size(); k += 3)
        released.push_back(all[k]);
      contact.set_closed(released, false);
      const ContactPressure pressure = contact.uniform_pressure(3e5);

      MultiVector x(rows, 3);
      for (unsigned int j = 0; j < x.n_columns(); ++j)
        for (unsigned int i = 0; i < x.n_local(); ++i)
          x.column(j)[i] = scattered(rows.begin + i, j);
      SurfaceVectors<3> surface(contact, x, 0, x.n_columns());

      using Products = std::vector<ContactProduct>;
      const auto check =
          [&](const Matrix &matrix,
              const std::function<Products(unsigned int, const ContactKinematics<3> &)> &products)
      {
        contact.for_each_pair(
            [&](const unsigned int i, const ContactKinematics<3> &k)
            {
              for (const ContactProduct &product : products(i, k))
                for (const bool transpose : {false, true})
                  if (!transpose || product.transposed_too)
                  {
                    DenseMatrix traces =
                        surface.traces(transpose ? product.left : product.right, k);
                    for (unsigned int q = 0; q < k.n_points; ++q)
                      for (unsigned int j = 0; j < traces.n_rows; ++j)
                        traces(j, q) *= product.c[q];
                    surface.add(transpose ? product.right : product.left, k, traces);
                  }
            });
        std::vector<Column> found = CellMap<3>(scene.spaces).zeros(x.n_columns());
        surface.add_to(found);
        MultiVector expected = multiply(matrix, x), difference = expected;
        clear_rows(expected, released); // N says there that Lambda = 0
        for (unsigned int j = 0; j < x.n_columns(); ++j)
          for (unsigned int i = 0; i < x.n_local(); ++i)
            difference.column(j)[i] = expected.column(j)[i] - found[j].local_element(i);
        CHECK(largest_entry(expected) > 0);
        CHECK(largest_entry(difference) <= 1e-13 * largest_entry(expected));
      };
      check(normal_matrix(contact), [&](const unsigned int i, const ContactKinematics<3> &k)
            { return normal_products(contact, i, k); });
      auto [largest, slopes] = friction_slopes(contact, pressure);
      for (std::vector<double> &of_interface : slopes)
        for (double &slope : of_interface)
          slope *= largest;
      check(friction_matrix(contact, pressure),
            [&, &slopes = slopes](const unsigned int i, const ContactKinematics<3> &k)
            { return Products{friction_product(contact, i, k, slopes)}; });
      const auto damping = friction_damping(contact, pressure);
      const auto part    = [&](const Origin origin, const unsigned int order)
      {
        return [&contact, &pressure, origin, order](const unsigned int i,
                                                    const ContactKinematics<3> &k)
        {
          Products wanted;
          for (const ContactProduct &product : damping_products(contact, i, k, pressure))
            if (product.origin == origin && product.order == order)
              wanted.push_back(product);
          return wanted;
        };
      };
      check(damping.P, part(Origin::friction_damping, 1));
      check(damping.Q, part(Origin::friction_damping, 0));
      check(damping.P_falling, part(Origin::falling_friction, 1));
      check(damping.Q_falling, part(Origin::falling_friction, 0));
    }
  }

  TEST_CASE("contact: P_R is positive semi-definite, that of a falling law negative")
  {
    // P_R = int c b b^T with c >= 0; the part of mu' < 0 is int mu' p e e^T.
    ContactScene scene("upper", true, 2);
    scene.model.friction.kind               = FrictionLaw::Kind::falling;
    scene.model.friction.coefficient_moving = 0.1;
    scene.model.friction.decay_speed        = 0.3;
    const auto &contact                     = scene.contact();
    const auto damping = friction_damping(contact, contact.uniform_pressure(1e6));
    const auto turning = eigenvalues_of_few_rows(scene.spaces.rows, damping.P);
    CHECK(turning.back() > 0);
    CHECK(turning.front() >= -1e-14 * turning.back());
    const auto falling = eigenvalues_of_few_rows(scene.spaces.rows, damping.P_falling);
    CHECK(falling.front() < 0);
    CHECK(falling.back() <= -1e-14 * falling.front());
    CHECK(asymmetry(scene.spaces.rows, damping.P_falling) <= 1e-15);
  }

  TEST_CASE("contact: damping of a falling friction law")
  {
    // mu(v) = 0.1 + 0.3 exp(-v/0.3), mu' = -exp(-v/0.3). P: int mu' p ([[v]].e)([[u]].e), for u = v
    // = e_y:
    //   p int mu'(|Omega| r) r dr int cos^2 phi dphi.
    // Q: int mu' p Omega ([[v]].e)(e.d_phi u), for v = e_y, u = x e_y (d_phi x = -y, odd in phi):
    // 0; for v = e_y and
    //   u = x e_x, e.d_phi u = (-sin)(-r sin): p Omega int mu' r^2 dr int cos phi sin^2 phi dphi
    //   with int cos sin^2 = 2 s^3/3. (e.e_y = cos phi; both e change sign with Omega.)
    const double p = 3e5, s = std::sin(ContactScene::angle / 2);
    for (const double omega : {4., -2.})
    {
      CAPTURE(omega);
      ContactScene scene("upper", false, 3, omega);
      scene.model.friction.kind               = FrictionLaw::Kind::falling;
      scene.model.friction.coefficient_moving = 0.1;
      scene.model.friction.decay_speed        = 0.3;
      const auto &contact                     = scene.contact();
      const auto damping = friction_damping(contact, contact.uniform_pressure(p));
      const auto slope   = [&](const double r) { return -std::exp(-std::abs(omega) * r / 0.3); };
      const MultiVector along_y = translation(scene.spaces, {rotor_body}, 1);
      const double P = p * cos_squared * over_radius([&](const double r) { return slope(r) * r; });
      CHECK(relative_error(bilinear_form(along_y, damping.P_falling, along_y), P) <= 1e-6);
      const MultiVector x_along_y = scene.on_rotor(
          [](const Point<3> &x) {
            return Tensor<1, 3>({0., x[0], 0.});
          });
      const MultiVector x_along_x = scene.on_rotor(
          [](const Point<3> &x) {
            return Tensor<1, 3>({x[0], 0., 0.});
          });
      const double Q = p * omega * 2 * s * s * s / 3 *
                       over_radius([&](const double r) { return slope(r) * r * r; });
      CHECK(relative_error(bilinear_form(along_y, damping.Q_falling, x_along_x), Q) <= 1e-6);
      CHECK(std::abs(bilinear_form(along_y, damping.Q_falling, x_along_y)) <= 1e-12 * std::abs(Q));
    }
  }

  TEST_CASE("contact: hanging nodes on both faces")
  {
    // Constants and the area survive: c^T N u of constants is the meshed area, all bodies together
    // do no work, and tilts by a plane give int x dA over the meshed pad if hanging nodes lie on
    // straight edges phi = const.
    ContactScene scene("upper", true, 2);
    refine_where(scene.spaces,
                 [](const Point<3> &x, const types::material_id body)
                 {
                   const double phi = std::atan2(x[1], x[0]) * 180 / M_PI;
                   return body == rotor_body ? (phi > 0 && phi < 22.5) : std::abs(phi) < 8;
                 });
    const Matrix N             = normal_matrix(scene.contact());
    const MultiVector pressure = constant_multiplier(scene.spaces, 1);
    const auto contact_face    = scene.geometry.boundaries.at("upper_pad.contact");
    const auto integral        = [&](const auto &f)
    {
      return integrate_boundary(scene.spaces, contact_face,
                                [&](const Point<3> &x, const Tensor<1, 3> &) { return f(x); });
    };
    CHECK(scene.spaces.triangulation.n_global_active_cells() > 35);
    CHECK(relative_error(bilinear_form(pressure, N, translation(scene.spaces, {rotor_body}, 2)),
                         integral([](const Point<3> &) { return 1.; })) <= 1e-12);
    CHECK(relative_error(
              bilinear_form(pressure, N, scene.axially([](const Point<3> &x) { return x[0]; })),
              integral([](const Point<3> &x) { return x[0]; })) <= 1e-10);
    CHECK(largest_entry(multiply(N, translation(scene.spaces, all_bodies, 2))) <=
          1e-14 * N.infinity_norm());
    const Matrix T = friction_of(scene.contact());
    for (unsigned int c = 0; c < 3; ++c)
      CHECK(largest_entry(multiply(transposed(T), translation(scene.spaces, all_bodies, c))) <=
            1e-14 * T.infinity_norm());
  }

  // Where nodes hang on a curved edge inside of the contact surface, refined and unrefined rotor
  // faces share one polynomial arc: they neither overlap nor leave a gap.
  TEST_CASE("contact: hanging nodes on an arc inside of the contact surface")
  {
    ContactScene scene("upper", true, 2);
    refine_where(scene.spaces,
                 [](const Point<3> &x, const types::material_id body)
                 {
                   return body == rotor_body && x[1] > 0 && x[1] < x[0] * std::tan(M_PI / 8) &&
                          std::hypot(x[0], x[1]) < 0.1;
                 });
    const double meshed_area =
        integrate_boundary(scene.spaces, scene.geometry.boundaries.at("upper_pad.contact"),
                           [](const Point<3> &, const Tensor<1, 3> &) { return 1.; });
    CHECK(relative_error(bilinear_form(constant_multiplier(scene.spaces, 1),
                                       normal_matrix(scene.contact()),
                                       translation(scene.spaces, {rotor_body}, 2)),
                         meshed_area) <= 1e-12);
  }
} // namespace squeal::tests::contact_tests

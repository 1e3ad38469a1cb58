#include <squeal/contact/contact.h>

#include <algorithm>
#include <complex>

namespace squeal
{
  template <int dim>
  typename Contact<dim>::FrictionWork
  Contact<dim>::friction_work(const MultiVector &re, const MultiVector &im, const double omega,
                              const Pressure &pressure, const bool with_damping) const
  {
    using Complex                                   = std::complex<double>;
    const std::array<std::vector<double>, 2> global = {{replicate(re), replicate(im)}};
    FrictionWork work;
    for (Pressure *part : {&work.friction, &work.damping, &work.falling})
      part->resize(paired_interfaces().size());
    for_each_pair(
        [&](const unsigned int i, const Kinematics &k)
        {
          const std::array<std::vector<double>, 2> local = {
              {k.local_values(global[0]), k.local_values(global[1])}};
          const auto amplitude =
              [&](const DenseMatrix &rows, const std::array<std::vector<double>, 2> &unknowns)
          {
            std::vector<Complex> result(k.n_points);
            const std::vector<double> of_re = k.at_points(rows, unknowns[0]),
                                      of_im = k.at_points(rows, unknowns[1]);
            for (unsigned int q = 0; q < k.n_points; ++q)
              result[q] = {of_re[q], of_im[q]};
            return result;
          };
          const auto along_e = amplitude(k.e(), local), along_b = amplitude(k.b(), local),
                     phi_e = amplitude(k.e_phi(), local), phi_b = amplitude(k.b_phi(), local);
          std::vector<Complex> dp =
              model.mortar ? amplitude(k.psi, {{k.active_multipliers(global[0], active),
                                                k.active_multipliers(global[1], active)}})
                           : amplitude(k.n(), local);
          for (unsigned int q = 0; q < k.n_points; ++q)
          {
            const unsigned int point = k.first_point + q;
            const double p_0         = pressure[i][point];
            dp[q] *= model.mortar ? scale : model.penalty_stiffness * active_points[i][point];
            // The pressures at which friction() and friction_damping() linearise.
            const auto law     = model.friction.traction(k.speeds[q], p_0),
                       tau     = model.friction.traction(k.speeds[q], std::max(0., p_0));
            const auto of_slip = [&](const double slope, const Complex jump, const Complex d_phi)
            {
              return -M_PI * slope *
                     (omega * std::norm(jump) +
                      model.angular_velocity * std::imag(std::conj(jump) * d_phi));
            };
            work.friction[i].push_back(-M_PI * law.d_pressure *
                                       std::imag(std::conj(along_e[q]) * dp[q]));
            work.damping[i].push_back(
                with_damping && dim == 3 ? of_slip(tau.over_speed, along_b[q], phi_b[q]) : 0.);
            work.falling[i].push_back(with_damping && !model.friction.is_flat()
                                          ? of_slip(tau.d_speed, along_e[q], phi_e[q])
                                          : 0.);
          }
        });
    return work;
  }

  template Contact<2>::FrictionWork Contact<2>::friction_work(const MultiVector &,
                                                              const MultiVector &, double,
                                                              const Pressure &, bool) const;
  template Contact<3>::FrictionWork Contact<3>::friction_work(const MultiVector &,
                                                              const MultiVector &, double,
                                                              const Pressure &, bool) const;
} // namespace squeal

#include "module/scene/analytic_data.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "compute/volume/heart_phantom.h"
#include "compute/volume/phantom.h"
#include "compute/volume/portable.h"
#include "module/scene/transform.h"

namespace palpate {
namespace {

constexpr double kPhantomHalfWidthM = 0.064;

/// A phantom of compute/volume by its formulas.
class AnalyticPhantom final : public FrameData {
 public:
  using ValueFunction = double (*)(glm::dvec3 lps_mm, int frame, int frames, uint32_t seed,
                                   double voxel_mm);
  using Gradient = glm::dvec3 (*)(glm::dvec3 lps_mm, int frame, int frames, uint32_t seed,
                                  double voxel_mm);
  AnalyticPhantom(ValueFunction value, Gradient gradient, int frame, int frames, uint32_t seed,
                  double voxel_mm)
      : value_(value),
        gradient_(gradient),
        frame_(frame),
        frames_(frames),
        seed_(seed),
        voxel_mm_(voxel_mm) {
    assert(frames > 0 && voxel_mm > 0.0);
  }

  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x_m) const noexcept override {
    return value_(lps_from_volume(x_m), frame_, frames_, seed_, voxel_mm_);
  }
  glm::dvec3 scalar_gradient(glm::dvec3 x_m) const noexcept override {
    // Axes turn as those of points do; the unit goes the other way: per mm to per m.
    const glm::dvec3 per_mm = gradient_(lps_from_volume(x_m), frame_, frames_, seed_, voxel_mm_);
    return 1e6 * volume_from_lps(per_mm);
  }
  glm::dvec3 vector(glm::dvec3 x_m) const noexcept override { return scalar_gradient(x_m); }
  glm::dmat3 vector_jacobian(glm::dvec3 x_m) const noexcept override {
    const double step = 0.5 * detail_m();
    glm::dmat3 jacobian;
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 aside(0.0);
      aside[a] = step;
      jacobian[a] = (scalar_gradient(x_m + aside) - scalar_gradient(x_m - aside)) / (2.0 * step);
    }
    return jacobian;
  }
  double detail_m() const noexcept override { return 1e-3 * voxel_mm_; }
  glm::dvec3 low_m() const noexcept override { return glm::dvec3(-kPhantomHalfWidthM); }
  glm::dvec3 high_m() const noexcept override { return glm::dvec3(kPhantomHalfWidthM); }

 private:
  ValueFunction value_;
  Gradient gradient_;
  int frame_, frames_;
  uint32_t seed_;
  double voxel_mm_;
};

class PointCharges final : public FrameData {
 public:
  PointCharges(std::vector<PointCharge> charges, glm::dvec3 low_m, glm::dvec3 high_m)
      : charges_(std::move(charges)), low_(low_m), high_(high_m) {
    for (const PointCharge& charge : charges_) detail_m_ = std::min(detail_m_, charge.softness_m);
  }

  bool is_vector() const noexcept override { return false; }
  double scalar(glm::dvec3 x_m) const noexcept override {
    double sum = 0.0;
    for (const PointCharge& charge : charges_) sum += charge.strength_v_m * near(charge, x_m).w;
    return sum;
  }
  glm::dvec3 scalar_gradient(glm::dvec3 x_m) const noexcept override {
    glm::dvec3 sum(0.0);
    for (const PointCharge& charge : charges_) {
      const glm::dvec4 at = near(charge, x_m);
      sum -= charge.strength_v_m * at.w * at.w * at.w * glm::dvec3(at);
    }
    return sum;
  }
  glm::dvec3 vector(glm::dvec3 x_m) const noexcept override { return scalar_gradient(x_m); }
  glm::dmat3 vector_jacobian(glm::dvec3 x_m) const noexcept override {
    glm::dmat3 sum(0.0);
    for (const PointCharge& charge : charges_) {
      const glm::dvec4 at = near(charge, x_m);
      const glm::dvec3 d(at);
      const double cubed = charge.strength_v_m * at.w * at.w * at.w;
      sum += 3.0 * cubed * at.w * at.w * glm::outerProduct(d, d) - glm::dmat3(cubed);
    }
    return sum;
  }
  double detail_m() const noexcept override { return detail_m_; }
  glm::dvec3 low_m() const noexcept override { return low_; }
  glm::dvec3 high_m() const noexcept override { return high_; }

 private:
  /// The way from the charge, and 1 / its softened length.
  static glm::dvec4 near(const PointCharge& charge, glm::dvec3 x_m) noexcept {
    const glm::dvec3 d = x_m - charge.position_m;
    return {d, 1.0 / std::sqrt(glm::dot(d, d) + charge.softness_m * charge.softness_m)};
  }

  std::vector<PointCharge> charges_;
  double detail_m_ = std::numeric_limits<double>::infinity();
  glm::dvec3 low_, high_;
};

constexpr double kMetresPerAngstrom = 0.02;
// e / (4 pi eps0), V angstrom.
constexpr double kVoltAngstrom = 14.39964;

}  // namespace

std::shared_ptr<const FrameData> analytic_shell(int frame, int frames, uint32_t seed,
                                                double voxel_mm) {
  return std::make_shared<AnalyticPhantom>(shell_value, shell_gradient, frame, frames, seed,
                                           voxel_mm);
}

std::shared_ptr<const FrameData> analytic_heart(int frame, int frames, uint32_t seed,
                                                double voxel_mm) {
  return std::make_shared<AnalyticPhantom>(heart_value, heart_gradient, frame, frames, seed,
                                           voxel_mm);
}

std::shared_ptr<const FrameData> point_charges(std::vector<PointCharge> charges, glm::dvec3 low_m,
                                               glm::dvec3 high_m) {
  assert(!charges.empty());
  return std::make_shared<PointCharges>(std::move(charges), low_m, high_m);
}

std::vector<glm::dvec3> dichloroethane_atoms_m() {
  constexpr double kBondCC = 1.53, kBondCCl = 1.79, kBondCH = 1.09;
  const double angle = 109.5 / 180.0 * std::numbers::pi;
  const glm::dvec3 carbon(-0.5 * kBondCC, 0.0, 0.0);
  // The second carbon lies along +x; the three others turn about that axis by 120 degrees.
  const auto bound = [&](double length, double turn_degrees) {
    const double turn = turn_degrees / 180.0 * std::numbers::pi;
    const auto [sine, cosine] = portable::sin_cos(angle);
    const glm::dvec3 along(cosine, sine * portable::cos(turn), sine * portable::sin(turn));
    return carbon + length * along;
  };
  std::vector<glm::dvec3> atoms{bound(kBondCCl, 0.0), carbon, bound(kBondCH, 120.0),
                                bound(kBondCH, -120.0)};
  for (int atom = 0; atom < 4; ++atom) atoms.push_back(-atoms[size_t(atom)]);
  for (glm::dvec3& atom : atoms) atom *= kMetresPerAngstrom;
  return atoms;
}

std::vector<PointCharge> dichloroethane_charges() {
  constexpr double kSoftnessAngstrom = 0.5;
  const double charge_e[4] = {-0.20, -0.04, 0.12, 0.12};
  const std::vector<glm::dvec3> atoms = dichloroethane_atoms_m();
  std::vector<PointCharge> charges;
  for (size_t atom = 0; atom < atoms.size(); ++atom)
    charges.push_back({atoms[atom], charge_e[atom % 4] * kVoltAngstrom * kMetresPerAngstrom,
                       kSoftnessAngstrom * kMetresPerAngstrom});
  return charges;
}

std::shared_ptr<const FrameData> dichloroethane() {
  constexpr double kMarginAngstrom = 2.5;
  glm::dvec3 reach(0.0);  // the molecule is symmetric about the origin
  for (const glm::dvec3& atom : dichloroethane_atoms_m()) reach = glm::max(reach, atom);
  reach += kMarginAngstrom * kMetresPerAngstrom;
  return point_charges(dichloroethane_charges(), -reach, reach);
}

}  // namespace palpate

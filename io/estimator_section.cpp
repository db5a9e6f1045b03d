#include "io/estimator_section.hpp"

#include <algorithm>

#include "io/registry_names.hpp"

namespace slipstream {
namespace {

// Two visitors of common/parameters.hpp that carry parameters of the same key and kind from one struct to another: what an
// estimator believes is what the vehicle is, unless the scenario says otherwise.
struct ParameterValues {
  std::map<std::string, double> numbers;
  std::map<std::string, std::vector<double>> lists;
  std::map<std::string, Vector3> triples;
  std::map<std::string, std::string> choices;
  std::map<std::string, std::vector<std::string>> choice_lists;
  std::map<std::string, bool> flags;
};

struct CollectParameters {
  ParameterValues& values;
  std::string prefix{};  // of the keys, as the model calls them
  void number(const std::string& key, const double& field, const Range&) { values.numbers[prefix + key] = field; }
  void list(const std::string& key, const std::vector<double>& field, const Range&) { values.lists[prefix + key] = field; }
  void triple(const std::string& key, const Vector3& field, const Range&) { values.triples[prefix + key] = field; }
  void choice(const std::string& key, const std::string& field, const Choices&) { values.choices[prefix + key] = field; }
  void choices(const std::string& key, const std::vector<std::string>& field, const Choices&) {
    values.choice_lists[prefix + key] = field;
  }
  void flag(const std::string& key, const bool& field) { values.flags[prefix + key] = field; }
};

struct ApplyParameters {
  const ParameterValues& values;
  template <typename Map, typename Field>
  static void apply(const Map& map, const std::string& key, Field& field) {
    if (const auto found = map.find(key); found != map.end()) field = found->second;
  }
  void number(const std::string& key, double& field, const Range&) { apply(values.numbers, key, field); }
  void list(const std::string& key, std::vector<double>& field, const Range&) { apply(values.lists, key, field); }
  void triple(const std::string& key, Vector3& field, const Range&) { apply(values.triples, key, field); }
  void choice(const std::string& key, std::string& field, const Choices&) { apply(values.choices, key, field); }
  void choices(const std::string& key, std::vector<std::string>& field, const Choices&) {
    apply(values.choice_lists, key, field);
  }
  void flag(const std::string& key, bool& field) { apply(values.flags, key, field); }
};

// Where the sensors sit and which way they look, the estimator takes from their own tables, unless this one says otherwise.
void read_strapdown(TomlTable& t, Strapdown& model, const Scenario& scenario) {
  ParameterValues values;
  const auto collect = [&](const auto& part, const std::string& prefix) {
    CollectParameters c{values, prefix};
    part.visit_parameters(part, c);
  };
  collect(scenario.world, "");
  if (scenario.imu) collect(*scenario.imu, "imu_");
  if (scenario.gnss) collect(*scenario.gnss, "gnss_");
  if (scenario.lidar) collect(*scenario.lidar, "lidar_");
  ApplyParameters apply{values};
  model.visit_parameters(model, apply);
  model.visit_parameters(model, t);
  if (!scenario.imu) t.refuse("type", "the model 'strapdown' needs an IMU: there is no [sensor.imu]");
}

void read_model(TomlTable& t, EstimatorConfig& estimator, const Scenario& scenario) {
  std::string type;
  std::vector<std::string> types = registered_names<AnyProcess>();
  types.emplace_back(Strapdown::kName);
  t.type(type, types);
  if (type == Strapdown::kName) return read_strapdown(t, estimator.strapdown.emplace(), scenario);
  AnyProcess& process = estimator.process;
  process = make_registered<AnyProcess>(type);
  ParameterValues values;
  CollectParameters collect{values};
  if (!scenario.recorded) std::visit([&](const auto& v) { v.visit_parameters(v, collect); }, scenario.plant.vehicle);
  ApplyParameters apply{values};
  std::visit(
      [&](auto& p) {
        p.visit_parameters(p, apply);
        p.visit_parameters(p, t);
      },
      process);
}

// What the maps of a tuning may name, and what they must.
struct ModelNames {
  std::vector<std::string> states, outputs;
  std::vector<std::string> measured;  // the outputs that the scenario has a sensor for
};

ModelNames model_names(const Scenario& scenario) {
  ModelNames names;
  std::visit(
      [&](const auto& p) {
        names.states = names_of(p.kStateNames);
        names.outputs = names_of(p.kOutputNames);
      },
      scenario.estimator.process);
  for (const std::string& output : names.outputs)
    for (const SensorConfig& sensor : scenario.sensors)
      if (sensor.quantity == output) names.measured.push_back(output);
  return names;
}

void read_tuning(TomlTable& t, Tuning& tuning, const ModelNames& names, const AnyProcess& process) {
  using Names = std::vector<std::string>;
  t.only({"measurement_noise",
          "measurement_variance",
          "process_noise",
          "process_variance",
          "start",
          "initial_mean",
          "initial_variance",
          "mhe_form",
          "mhe_solver",
          "mhe_window",
          "arrival_weight",
          "measurement_weight",
          "pf_particles",
          "pf_resample_below",
          "pf_resampling",
          "pf_recover",
          "ukf_alpha",
          "ukf_beta",
          "ukf_kappa",
          "ukf_redraw",
          "model"});
  t.choice("measurement_noise", tuning.measurement_noise, {"sensors", "given"});
  t.numbers("measurement_variance", tuning.measurement_variance, names.outputs,
            tuning.measurement_noise == "given" ? names.measured : Names{}, positive());
  t.choice("process_noise", tuning.process_noise, {"density", "step"});
  t.numbers("process_variance", tuning.process_variance, names.states, names.states, non_negative());
  t.choice("start", tuning.start, {"given", "measured"});
  const bool given = tuning.start == "given";
  if (!given)
    for (const std::string& state : names.states) tuning.initial_mean[state] = 0.0;
  t.numbers("initial_mean", tuning.initial_mean, names.states, given ? names.states : Names{}, any_number());
  t.numbers("initial_variance", tuning.initial_variance, names.states, names.states, positive());

  t.choice("mhe_form", tuning.mhe_form, {"multiple_shooting", "single_shooting"});
  const bool single = tuning.mhe_form == "single_shooting";
  t.choice("mhe_solver", tuning.mhe_solver, {"ipopt", "rti"});
  t.integer("mhe_window", tuning.mhe_window, 1, 1000);
  t.numbers("arrival_weight", tuning.arrival_weight, names.states, single ? names.states : Names{}, non_negative());
  t.numbers("measurement_weight", tuning.measurement_weight, names.outputs, single ? names.measured : Names{}, non_negative());

  t.number("ukf_alpha", tuning.ukf_alpha, Range{0.0, 10.0, true});
  t.number("ukf_beta", tuning.ukf_beta, between(0.0, 100.0));
  t.number("ukf_kappa", tuning.ukf_kappa, between(-100.0, 100.0));
  if (!(tuning.ukf_kappa > -static_cast<double>(names.states.size())))
    t.refuse("ukf_kappa", "expected a number above minus the model's " + std::to_string(names.states.size()) + " states");
  t.flag("ukf_redraw", tuning.ukf_redraw);

  t.integer("pf_particles", tuning.pf_particles, 1, 1000000);
  t.number("pf_resample_below", tuning.pf_resample_below, {0.0, 1.0, true});
  t.choice("pf_resampling", tuning.pf_resampling, {"systematic", "stratified", "residual"});
  t.flag("pf_recover", tuning.pf_recover);

  if (!t.has("model")) return;
  tuning.process = process;
  t.table("model", [&](TomlTable& m) { std::visit([&](auto& p) { p.visit_parameters(p, m); }, *tuning.process); });
}

void read_strapdown_tuning(TomlTable& t, StrapdownTuning& tuning) {
  tuning.visit_parameters(tuning, t);
  if (tuning.start == "given" && !t.has("initial_position_m"))
    t.refuse("start", "\"given\" needs initial_position_m, initial_velocity_mps, initial_rpy_rad");
}

}  // namespace

void read_estimator(TomlTable& root, Scenario& scenario, const TextForm& name_form) {
  EstimatorConfig& estimator = scenario.estimator;
  const std::vector<std::string> tunings = root.keys_of("tuning");
  if (tunings.empty()) root.refuse("tuning", "expected at least one table [tuning.NAME]");
  for (const std::string& name : tunings)
    if (!name_form.accepts(name)) root.refuse("tuning", std::string("expected tables named by ") + name_form.expected);

  ModelNames names;
  root.table("estimator", [&](TomlTable& t) {
    t.only({"tuning", "model", "bounds"});
    t.choice("tuning", estimator.tuning, tunings);
    t.table("model", [&](TomlTable& m) { read_model(m, estimator, scenario); });
    if (estimator.strapdown) {
      if (t.has("bounds")) t.refuse("bounds", "a strapdown model has none");
      return;
    }
    names = model_names(scenario);
    t.table("bounds", [&](TomlTable& b) {
      b.numbers("lower", estimator.lower_bound, names.states, {}, any_number());
      b.numbers("upper", estimator.upper_bound, names.states, {}, any_number());
      for (const auto& [state, lower] : estimator.lower_bound)
        if (const auto upper = estimator.upper_bound.find(state);
            upper != estimator.upper_bound.end() && !(lower < upper->second))
          b.refuse("upper", "of '" + state + "' is not greater than its lower bound");
    });
  });
  root.table("tuning", [&](TomlTable& t) {
    for (const std::string& name : tunings)
      t.table(name, [&](TomlTable& one) {
        if (estimator.strapdown) return read_strapdown_tuning(one, estimator.tunings[name].strapdown);
        read_tuning(one, estimator.tunings[name], names, estimator.process);
      });
  });
}

}  // namespace slipstream

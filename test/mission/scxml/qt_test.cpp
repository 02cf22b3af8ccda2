// `dive graph --format scxml` in an independent engine: Qt's loads it and takes the same
// transitions on the same events.

#include <QBuffer>
#include <QCoreApplication>
#include <QScxmlStateMachine>
#include <algorithm>
#include <filesystem>
#include <set>

#include <gtest/gtest.h>

#include "common/random.h"
#include "mission/executive/machine_graph.h"
#include "mission/statechart/interpreter.h"

namespace dive::mission {
namespace {

/// All variables zero, as in the SCXML; `battery_fraction` too.
GuardVariables zeros() {
  GuardVariables variables;
  variables.battery_fraction = 0.0;
  variables.temperature = 0.0;
  return variables;
}

/// Executes the SCXML's executable content as far as it changes the machine.
class Ours final : public statechart::Environment {
 public:
  explicit Ours(const Machine& machine) : machine_(machine), interpreter_(machine.chart, *this) {
    interpreter_.start();
  }
  bool evaluate(statechart::GuardId guard) override {
    return machine_.guards[static_cast<std::size_t>(guard)].evaluate(zeros());
  }
  void execute(statechart::ActionId id) override {
    const ActionSpec& action = machine_.actions[static_cast<std::size_t>(id)];
    if (action.kind == ActionSpec::Kind::kRaise) interpreter_.raise(action.text.value);
  }
  void entered(statechart::StateId) override {}
  void exited(statechart::StateId) override {}
  void taken(int, const std::string&) override {}

  void dispatch(const std::string& event) { interpreter_.dispatch(event); }
  [[nodiscard]] bool running() const { return interpreter_.running(); }
  [[nodiscard]] std::set<std::string> active() const {
    std::set<std::string> ids;
    for (const statechart::StateId state : interpreter_.configuration()) {
      ids.insert(machine_.chart.states[static_cast<std::size_t>(state)].id);
    }
    return ids;
  }

 private:
  const Machine& machine_;
  statechart::Interpreter interpreter_;
};

class Theirs {
 public:
  explicit Theirs(const std::string& scxml) {
    QByteArray bytes = QByteArray::fromStdString(scxml);
    QBuffer buffer(&bytes);
    buffer.open(QIODevice::ReadOnly);
    machine_.reset(QScxmlStateMachine::fromData(&buffer, "mission.scxml"));
    for (const QScxmlError& error : machine_->parseErrors()) {
      ADD_FAILURE() << error.toString().toStdString();
    }
    machine_->start();
    settle();
  }
  void dispatch(const std::string& event) {
    machine_->submitEvent(QString::fromStdString(event));
    settle();
  }
  [[nodiscard]] bool running() const { return machine_->isRunning(); }
  [[nodiscard]] std::set<std::string> active() const {
    std::set<std::string> ids;
    for (const QString& name : machine_->activeStateNames(false)) ids.insert(name.toStdString());
    return ids;
  }

 private:
  static void settle() {
    for (int i = 0; i < 10; ++i) QCoreApplication::processEvents();
  }
  std::unique_ptr<QScxmlStateMachine> machine_;
};

std::vector<std::string> events_of(const Machine& machine) {
  std::set<std::string> events = {"unhandled.event"};
  for (const statechart::Transition& transition : machine.chart.transitions) {
    for (std::string event : transition.events) {
      if (event == "*") continue;
      if (event.ends_with(".*")) event.resize(event.size() - 2);
      events.insert(event);
    }
  }
  return {events.begin(), events.end()};
}

std::vector<std::string> mission_files() {
  std::vector<std::string> files;
  for (const char* folder : {"/missions", "/test/mission/accepted"}) {
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(DIVE_SOURCE_DIR) + folder)) {
      if (entry.path().extension() == ".xml") files.push_back(entry.path().string());
    }
  }
  std::ranges::sort(files);
  return files;
}

TEST(QtScxml, TakesTheSameTransitionsOnTheSameEvents) {
  int steps = 0;
  int moves = 0;
  for (const std::string& file : mission_files()) {
    SCOPED_TRACE(file);
    Diagnostics diagnostics;
    const std::optional<Mission> mission = load_mission(file, diagnostics);
    ASSERT_TRUE(mission);
    const Machine machine = build_machine(*mission);
    const std::string scxml = to_scxml(machine, mission->id);
    const std::vector<std::string> events = events_of(machine);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Random random(seed);
      Ours ours(machine);
      Theirs theirs(scxml);
      ASSERT_EQ(ours.active(), theirs.active()) << "at first";
      std::string record;
      for (int i = 0; i < 30 && ours.running(); ++i) {
        // Frequent takeovers by the executive would end it too soon.
        const bool takeover = random.bits() % 20 == 0;
        const std::string& event = events[random.bits() % events.size()];
        if (event.starts_with("dive.") && !takeover) continue;
        const std::set<std::string> before = ours.active();
        ours.dispatch(event);
        theirs.dispatch(event);
        record += event + " ";
        ++steps;
        moves += before != ours.active() ? 1 : 0;
        ASSERT_EQ(ours.running(), theirs.running()) << record;
        if (!ours.running()) break;
        ASSERT_EQ(ours.active(), theirs.active()) << record;
      }
    }
  }
  EXPECT_GT(steps, 1000);
  EXPECT_GT(moves, 300);
}

}  // namespace
}  // namespace dive::mission

int main(int argc, char** argv) {
  QCoreApplication application(argc, argv);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}

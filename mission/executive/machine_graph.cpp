#include "mission/executive/machine_graph.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/xml.h"
#include "mission/document/guard.h"

namespace dive::mission {
namespace {

using statechart::State;
using statechart::StateId;
using statechart::StateKind;
using statechart::Transition;

/// In double quotes, for DOT.
std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

class Writer {
 public:
  explicit Writer(const Machine& machine) : machine_(machine) {}

 protected:
  [[nodiscard]] const State& state(StateId id) const {
    return machine_.chart.states[static_cast<std::size_t>(id)];
  }
  [[nodiscard]] const Transition& transition(int index) const {
    return machine_.chart.transitions[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] const Guard* guard(const Transition& t) const {
    return t.guard < 0 ? nullptr : &machine_.guards[static_cast<std::size_t>(t.guard)];
  }
  [[nodiscard]] bool is_executives_own(StateId id) const {
    return machine_.specs[static_cast<std::size_t>(id)] == nullptr;
  }

  const Machine& machine_;
};

class DotWriter : Writer {
 public:
  explicit DotWriter(const Machine& machine) : Writer(machine) {}

  std::string write(const std::string& title) {
    text_ = fmt::format(
        "digraph {} {{\n  compound=true; rankdir=TB; fontname=\"Helvetica\";\n"
        "  node [shape=box, style=rounded, fontname=\"Helvetica\"];\n"
        "  edge [fontname=\"Helvetica\", fontsize=10];\n",
        in_quotes(title));
    for (const StateId child : state(0).children) write_state(child, 1);
    text_ += "  \"(start)\" [shape=point];\n";
    edge_from_start(transition(state(0).initial).targets.front());
    for (const Transition& t : machine_.chart.transitions) write_transition(t);
    return text_ + "}\n";
  }

 private:
  void indent(int depth) { text_.append(2 * static_cast<std::size_t>(depth), ' '); }

  void write_state(StateId id, int depth) {
    const State& s = state(id);
    indent(depth);
    const bool is_box = s.kind == StateKind::kCompound || s.kind == StateKind::kParallel;
    const char* grey = is_executives_own(id) ? ", color=grey, fontcolor=grey" : "";
    if (!is_box) {
      const char* shape = s.kind == StateKind::kFinal            ? "doublecircle"
                          : s.kind == StateKind::kShallowHistory ? "circle, label=\"H\""
                          : s.kind == StateKind::kDeepHistory    ? "circle, label=\"H*\""
                                                                 : "box";
      text_ += fmt::format("{} [shape={}{}{}];\n", in_quotes(s.id), shape, kind_label(id), grey);
      return;
    }
    text_ += fmt::format("subgraph {} {{ label={}; style={}{};\n", in_quotes("cluster_" + s.id),
                         in_quotes(s.id), s.kind == StateKind::kParallel ? "dashed" : "rounded",
                         is_executives_own(id) ? "; color=grey; fontcolor=grey" : "");
    for (const StateId child : s.children) write_state(child, depth + 1);
    indent(depth);
    text_ += "}\n";
  }

  [[nodiscard]] std::string kind_label(StateId id) const {
    const StateSpec* spec = machine_.specs[static_cast<std::size_t>(id)];
    if (spec == nullptr || state(id).kind != StateKind::kAtomic) return {};
    std::string label = fmt::format("{}\n{}", spec->id.value, spec->element);
    if (spec->overhead) label += "\nunder an overhead";
    return fmt::format(", label={}", in_quotes(label));
  }

  /// An edge needs a node: the first one in the cluster.
  [[nodiscard]] StateId node_of(StateId id) const {
    while (!state(id).children.empty()) id = state(id).children.front();
    return id;
  }

  void edge_from_start(StateId target) {
    text_ += fmt::format("  \"(start)\" -> {}", in_quotes(state(node_of(target)).id));
    text_ += cluster("lhead", target) + ";\n";
  }

  [[nodiscard]] std::string cluster(const char* attribute, StateId id) const {
    if (state(id).children.empty()) return {};
    return fmt::format(" [{}={}]", attribute, in_quotes("cluster_" + state(id).id));
  }

  void write_transition(const Transition& t) {
    const bool is_initial = t.source == 0 || (t.events.empty() && t.guard < 0 && t.internal);
    const bool is_takeover = !t.events.empty() && t.events.front().starts_with("dive.");
    if (is_initial || is_takeover) return;
    std::string label = fmt::format("{}", fmt::join(t.events, "\n"));
    if (const Guard* g = guard(t)) label += fmt::format("\n[{}]", g->text());
    for (const StateId target : t.targets) {
      text_ += fmt::format("  {} -> {} [label={}", in_quotes(state(node_of(t.source)).id),
                           in_quotes(state(node_of(target)).id), in_quotes(label));
      if (!state(t.source).children.empty()) {
        text_ += fmt::format(", ltail={}", in_quotes("cluster_" + state(t.source).id));
      }
      if (!state(target).children.empty()) {
        text_ += fmt::format(", lhead={}", in_quotes("cluster_" + state(target).id));
      }
      if (is_executives_own(t.source)) text_ += ", color=grey, fontcolor=grey";
      text_ += "];\n";
    }
  }

  std::string text_;
};

class ScxmlWriter : Writer {
 public:
  explicit ScxmlWriter(const Machine& machine) : Writer(machine) {}

  std::string write(const std::string& name) {
    text_ = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
        "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" "
        "datamodel=\"ecmascript\" name=\"{}\" initial=\"{}\">\n  <datamodel>\n",
        escape_xml(name), targets(transition(state(0).initial)));
    for (const auto& [variable, value] : Guard::script_variables()) {
      text_ += fmt::format("    <data id=\"{}\" expr=\"{}\"/>\n", variable, value);
    }
    text_ += "  </datamodel>\n";
    for (const StateId child : state(0).children) write_state(child, 1);
    return text_ + "</scxml>\n";
  }

 private:
  void line(int depth, const std::string& content) {
    text_.append(2 * static_cast<std::size_t>(depth), ' ');
    text_ += content + "\n";
  }

  [[nodiscard]] std::string targets(const Transition& t) const {
    std::string text;
    for (const StateId target : t.targets) {
      if (!text.empty()) text += ' ';
      text += state(target).id;
    }
    return text;
  }

  void write_state(StateId id, int depth) {
    const State& s = state(id);
    const bool is_history =
        s.kind == StateKind::kShallowHistory || s.kind == StateKind::kDeepHistory;
    const char* element = s.kind == StateKind::kParallel ? "parallel"
                          : s.kind == StateKind::kFinal  ? "final"
                          : is_history                   ? "history"
                                                         : "state";
    std::string open = fmt::format("<{} id=\"{}\"", element, s.id);
    if (is_history) {
      open += s.kind == StateKind::kDeepHistory ? " type=\"deep\"" : " type=\"shallow\"";
    }
    line(depth, open + ">");
    // An initial element instead of an attribute, because its targets may be deeper than a child.
    if (s.initial >= 0 && !is_history) {
      line(depth + 1, fmt::format("<initial><transition target=\"{}\"/></initial>",
                                  targets(transition(s.initial))));
    }
    if (is_history) {
      line(depth + 1, fmt::format("<transition target=\"{}\"/>", targets(transition(s.initial))));
    }
    write_actions("onentry", s.on_entry, depth + 1);
    write_actions("onexit", s.on_exit, depth + 1);
    for (const int t : s.transitions) write_transition(transition(t), depth + 1);
    for (const StateId child : s.children) write_state(child, depth + 1);
    line(depth, fmt::format("</{}>", element));
  }

  void write_actions(const char* element, const std::vector<statechart::ActionId>& actions,
                     int depth) {
    if (actions.empty()) return;
    line(depth, fmt::format("<{}>", element));
    for (const statechart::ActionId action : actions) write_action(action, depth + 1);
    line(depth, fmt::format("</{}>", element));
  }

  void write_action(statechart::ActionId id, int depth) {
    const ActionSpec& action = machine_.actions[static_cast<std::size_t>(id)];
    switch (action.kind) {
      case ActionSpec::Kind::kLog: {
        std::string text;
        for (const char c : action.text.value) {
          if (c == '\'' || c == '\\') text += '\\';
          text += c == '\n' || c == '\r' ? ' ' : c;
        }
        return line(depth, fmt::format("<log expr=\"'{}'\"/>", escape_xml(text)));
      }
      case ActionSpec::Kind::kRaise:
        return line(depth, fmt::format("<raise event=\"{}\"/>", action.text.value));
      case ActionSpec::Kind::kPayload:
        return line(depth, fmt::format("<send event=\"payload.{}\"/>", action.text.value));
    }
  }

  void write_transition(const Transition& t, int depth) {
    std::string open = "<transition";
    if (!t.events.empty()) open += fmt::format(" event=\"{}\"", fmt::join(t.events, " "));
    if (const Guard* g = guard(t)) open += fmt::format(" cond=\"{}\"", escape_xml(g->script()));
    if (!t.targets.empty()) open += fmt::format(" target=\"{}\"", targets(t));
    if (t.internal) open += " type=\"internal\"";
    if (t.actions.empty()) return line(depth, open + "/>");
    line(depth, open + ">");
    for (const statechart::ActionId action : t.actions) write_action(action, depth + 1);
    line(depth, "</transition>");
  }

  std::string text_;
};

}  // namespace

std::string to_dot(const Machine& machine, const std::string& title) {
  return DotWriter(machine).write(title);
}

std::string to_scxml(const Machine& machine, const std::string& name) {
  return ScxmlWriter(machine).write(name);
}

}  // namespace dive::mission

#include "vehicle/urdf_reader.h"

#include <array>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "common/suggest.h"
#include "vehicle/urdf_elements.h"

namespace dive::vehicle {
namespace {

class Reader {
 public:
  Reader(const XmlDocument& document, Diagnostics& diagnostics)
      : root_(document.root),
        elements_(document.source, diagnostics),
        diagnostics_(diagnostics),
        model_(std::make_shared<urdf::ModelInterface>()) {}

  urdf::ModelInterfaceSharedPtr read() {
    const std::size_t errors_before = diagnostics_.error_count();
    if (!check_root()) return nullptr;
    for (const XmlElement& child : root_.children) read_child(child);
    if (diagnostics_.error_count() > errors_before) return nullptr;
    for (const auto& [joint, element] : joints_) connect(joint, *element);
    if (diagnostics_.error_count() > errors_before) return nullptr;
    find_root();
    check_chains();
    if (diagnostics_.error_count() > errors_before) return nullptr;
    fill_in_children();
    return model_;
  }

 private:
  bool check_root() {
    if (root_.name != "robot" || !root_.namespace_uri.empty()) {
      elements_.error("URDF-ROOT", root_.span,
                      fmt::format("the root element is <{}>: expected <robot>", root_.name));
      return false;
    }
    for (const XmlElement& child : root_.children) {
      if (child.namespace_uri.find("xacro") == std::string::npos) continue;
      elements_.error("URDF-XACRO", child.span, "this is xacro, not URDF",
                      "expand it first: xacro FILE > vehicle.urdf");
      return false;
    }
    model_->name_ = elements_.text(root_, "name");
    static const std::array<std::string, 7> kKnown{"link",         "joint",  "material", "gazebo",
                                                   "transmission", "sensor", "motion"};
    elements_.check_children(root_, kKnown);
    return true;
  }

  void read_child(const XmlElement& child) {
    if (!child.namespace_uri.empty()) return;
    if (child.name == "link") {
      add_link(child);
    } else if (child.name == "joint") {
      add_joint(child);
    }
  }

  void add_link(const XmlElement& element) {
    urdf::LinkSharedPtr link = elements_.link(element);
    if (link->name.empty()) return;
    if (!model_->links_.try_emplace(link->name, link).second) {
      elements_.error("URDF-DUPLICATE", element.attribute("name")->value_span,
                      fmt::format("there is already a link '{}'", link->name));
      return;
    }
    links_.emplace_back(std::move(link), &element);
  }

  void add_joint(const XmlElement& element) {
    urdf::JointSharedPtr joint = elements_.joint(element);
    if (joint->name.empty()) return;
    if (!model_->joints_.try_emplace(joint->name, joint).second) {
      elements_.error("URDF-DUPLICATE", element.attribute("name")->value_span,
                      fmt::format("there is already a joint '{}'", joint->name));
      return;
    }
    joints_.emplace_back(std::move(joint), &element);
  }

  urdf::LinkSharedPtr find_link(const std::string& name, const XmlElement& joint, const char* end) {
    const auto found = model_->links_.find(name);
    if (found != model_->links_.end()) return found->second;
    std::vector<std::string> names;
    names.reserve(links_.size());
    for (const auto& [link, element] : links_) names.push_back(link->name);
    elements_.error("URDF-LINK", joint.child(end)->attribute("link")->value_span,
                    fmt::format("there is no link '{}'", name), did_you_mean(name, names));
    return nullptr;
  }

  // Attaches the joint's child link to its parent link.
  void connect(const urdf::JointSharedPtr& joint, const XmlElement& element) {
    const urdf::LinkSharedPtr parent = find_link(joint->parent_link_name, element, "parent");
    const urdf::LinkSharedPtr child = find_link(joint->child_link_name, element, "child");
    if (!parent || !child) return;
    if (child->parent_joint) {
      elements_.error("URDF-TREE", element.child("child")->attribute("link")->value_span,
                      fmt::format("link '{}' already hangs on joint '{}'", child->name,
                                  child->parent_joint->name));
      return;
    }
    child->parent_joint = joint;
    child->setParent(parent);
  }

  void find_root() {
    for (const auto& [link, element] : links_) {
      if (link->parent_joint) continue;
      if (!model_->root_link_) {
        model_->root_link_ = link;
      } else {
        elements_.error("URDF-TREE", element->attribute("name")->value_span,
                        fmt::format("link '{}' hangs on no joint, and neither does '{}': expected "
                                    "one root",
                                    link->name, model_->root_link_->name));
      }
    }
    if (links_.empty()) {
      elements_.error("URDF-TREE", root_.span, "the robot has no link");
    } else if (!model_->root_link_) {
      elements_.error("URDF-TREE", joints_.front().second->span,
                      "the joints form a cycle: every link hangs on another, none is the root");
    }
  }

  // Every link has at most one parent here, so a walk upwards ends at the root, returns to the link
  // itself, or enters a cycle further up, which exceeds the maximum chain length.
  void check_chains() {
    if (!model_->root_link_) return;
    for (const auto& [link, element] : links_) {
      int length = 0;
      urdf::LinkSharedPtr above = link;
      while (above->getParent() && length <= kMaxJointChain) {
        above = above->getParent();
        ++length;
        if (above == link) break;
      }
      if (above != link && length <= kMaxJointChain) continue;
      if (length == 0) continue;
      elements_.error("URDF-TREE", element->attribute("name")->value_span,
                      above == link
                          ? fmt::format("link '{}' is part of a cycle of joints", link->name)
                          : fmt::format("link '{}' is more than {} joints away from the root",
                                        link->name, kMaxJointChain));
      return;
    }
  }

  // Only after the checks: shared pointers in a cycle would never be released.
  void fill_in_children() {
    for (const auto& [joint, element] : joints_) {
      const urdf::LinkSharedPtr& parent = model_->links_.at(joint->parent_link_name);
      parent->child_joints.push_back(joint);
      parent->child_links.push_back(model_->links_.at(joint->child_link_name));
    }
  }

  const XmlElement& root_;
  UrdfElements elements_;
  Diagnostics& diagnostics_;
  urdf::ModelInterfaceSharedPtr model_;
  std::vector<std::pair<urdf::LinkSharedPtr, const XmlElement*>> links_;
  std::vector<std::pair<urdf::JointSharedPtr, const XmlElement*>> joints_;
};

}  // namespace

urdf::ModelInterfaceSharedPtr read_urdf_model(const XmlDocument& document,
                                              Diagnostics& diagnostics) {
  return Reader(document, diagnostics).read();
}

}  // namespace dive::vehicle

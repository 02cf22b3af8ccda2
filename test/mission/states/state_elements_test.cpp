// The registry of the elements that steer.

#include "mission/states/state_elements.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "mission/document/language.h"

namespace dive::mission {
namespace {

TEST(StateElements, AreThoseOfTheSchemaThatAreNotStructure) {
  std::set<std::string> in_schema;
  for (const std::string& name : Language(mission_schema()).type_rule("States").child_names()) {
    in_schema.insert(name);
  }
  for (const char* structure : {"include", "state", "parallel", "final"}) {
    EXPECT_EQ(in_schema.erase(structure), 1U) << structure;
  }
  std::set<std::string> registered;
  for (const StateElement& element : state_elements()) {
    EXPECT_TRUE(registered.emplace(element.name).second) << element.name << " is there twice";
    EXPECT_EQ(find_state_element(element.name), &element);
  }
  EXPECT_EQ(registered, in_schema);
  EXPECT_EQ(find_state_element("state"), nullptr);
  EXPECT_EQ(find_state_element("holding"), nullptr);
}

TEST(StateElements, HaveRulesWithTheCodesOfTheDocumentOrOfTheMap) {
  for (const Rule& rule : state_rules()) {
    const std::string code = rule.code;
    EXPECT_TRUE(code.starts_with("MIS-") || code.starts_with("CHK-")) << code;
  }
}

}  // namespace
}  // namespace dive::mission

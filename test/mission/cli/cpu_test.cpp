// A dive does not depend on the CPU's optional instructions, nor does the replay of its log.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <dlfcn.h>
#include <elf.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <link.h>
#include <nlohmann/json.hpp>

#include "common/mathematics.h"
#include "mission/record/log.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using testing::content_of;
using ::testing::HasSubstr;
using testing::own_folder;
using testing::Ran;
using testing::run_here;
using testing::shipped;

// libm and libstdc++ then choose the code of an x86-64 CPU without these.
const std::string kOldCpu = "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F";

/// Without the log of an earlier dive, b.lcmlog.
Ran dive_anew(const std::string& arguments, const std::string& setup = {}) {
  fs::remove(own_folder() / "b.lcmlog");
  return run_here(arguments, setup);
}

TEST(AnyCpu, ADiveAndItsReplayAreTheSameWithoutOptionalInstructions) {
  for (const char* name : {"window", "penetration", "wreck", "orbit", "cluttered"}) {
    for (const char* log : {"a.lcmlog", "b.lcmlog"}) {
      fs::remove(own_folder() / log);
      fs::remove(own_folder() / (std::string(log) + ".journal"));
    }
    ASSERT_EQ(dive_anew("run --log a.lcmlog " + shipped(name)).status, 0) << name;
    ASSERT_EQ(dive_anew("run --log b.lcmlog " + shipped(name), kOldCpu).status, 0) << name;
    EXPECT_TRUE(content_of(own_folder() / "a.lcmlog") == content_of(own_folder() / "b.lcmlog"))
        << name;
    EXPECT_EQ(dive_anew("replay a.lcmlog", kOldCpu).status, 0) << name;
  }
}

TEST(AnyCpu, AReplayIsIdenticalOnEmulatedCpus) {
  if (std::system("command -v qemu-x86_64 >/dev/null") != 0) {
    GTEST_SKIP() << "qemu-user is not installed";
  }
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the address sanitizer does not run under qemu-user";
#endif
  ASSERT_EQ(dive_anew("run --log a.lcmlog " + shipped("pool1")).status, 0);
  for (const char* cpu : {"Nehalem", "max"}) {
    const Ran ran = dive_anew("replay a.lcmlog", fmt::format("qemu-x86_64 -cpu {}", cpu));
    EXPECT_EQ(ran.status, 0) << cpu << ": " << ran.out << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("identical")) << cpu;
  }
}

// ------------------------------------------------------------------------ every library

/// The undefined functions of one loaded library.
std::set<std::string> imports_of(const dl_phdr_info& info) {
  const char* strings = nullptr;
  const ElfW(Sym)* symbols = nullptr;
  const ElfW(Rela)* relocations = nullptr;
  std::size_t size = 0;
  for (int i = 0; i < info.dlpi_phnum; ++i) {
    if (info.dlpi_phdr[i].p_type != PT_DYNAMIC) continue;
    const auto* entry =
        reinterpret_cast<const ElfW(Dyn)*>(info.dlpi_addr + info.dlpi_phdr[i].p_vaddr);
    for (; entry->d_tag != DT_NULL; ++entry) {  // glibc has made the pointers absolute
      if (entry->d_tag == DT_STRTAB) strings = reinterpret_cast<const char*>(entry->d_un.d_ptr);
      if (entry->d_tag == DT_SYMTAB) {
        symbols = reinterpret_cast<const ElfW(Sym)*>(entry->d_un.d_ptr);
      }
      if (entry->d_tag == DT_JMPREL) {
        relocations = reinterpret_cast<const ElfW(Rela)*>(entry->d_un.d_ptr);
      }
      if (entry->d_tag == DT_PLTRELSZ) size = entry->d_un.d_val;
    }
  }
  std::set<std::string> names;
  for (std::size_t i = 0; i < size / sizeof(ElfW(Rela)); ++i) {
    const ElfW(Sym)& symbol = symbols[relocations[i].r_info >> 32U];
    if (symbol.st_shndx == SHN_UNDEF) names.insert(strings + symbol.st_name);
  }
  return names;
}

struct Loaded {
  std::string name;
  std::set<std::string> imports;
};

std::vector<Loaded> loaded_libraries() {
  std::vector<Loaded> libraries;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* result) {
        const std::string_view path = info->dlpi_name;
        const std::string name(path.substr(path.rfind('/') + 1));
        if (!name.starts_with("linux-vdso")) {
          static_cast<std::vector<Loaded>*>(result)->push_back({name, imports_of(*info)});
        }
        return 0;
      },
      &libraries);
  return libraries;
}

std::string defined_in(const char* function) {
  Dl_info info{};
  void* const address = dlsym(RTLD_DEFAULT, function);
  if (address == nullptr || dladdr(address, &info) == 0) return {};
  const std::string_view path = info.dli_fname;
  return std::string(path.substr(path.rfind('/') + 1));
}

// Functions of libm whose results IEEE 754 or their definition prescribes to the last bit.
const std::set<std::string> kExact = {
    "ceil",     "ceilf",     "copysign",      "fegetround",   "fesetround",   "fdim",
    "floor",    "floorf",    "fma",           "fmaf",         "fmax",         "fmaxf",
    "fmin",     "fminf",     "fmod",          "fmodf",        "frexp",        "frexpf",
    "frexpl",   "ldexp",     "ldexpf",        "llrint",       "llround",      "llroundf",
    "logb",     "lrint",     "lrintf",        "lround",       "lroundf",      "modf",
    "modff",    "nearbyint", "nextafter",     "nextafterf",   "remainder",    "rint",
    "rintf",    "round",     "roundf",        "scalbn",       "sqrt",         "sqrtf",
    "trunc",    "truncf",    "feclearexcept", "fetestexcept", "feholdexcept", "feupdateenv",
    "fesetenv", "fegetenv",  "ilogb",         "remainderf",   "remquo",       "remquof"};

// GeographicLib contains its classes in long double, and complex projections. We use the double
// ones of the tangent plane.
bool is_long_or_complex(const std::string& library, const std::string& function) {
  if (!library.starts_with("libGeographicLib")) return false;
  return function.ends_with('l') || function == "cabs" || function == "cexp";
}

TEST(AnyCpu, EveryLibraryOfTheControlPathUsesThePinnedFunctions) {
  // Only for images, whose results enter the log as inputs.
  const std::array images = {"libopencv", "liblapack", "libgfortran", "libquadmath", "libgsl",
                             "libode",    "libm.so",   "libsleef",    "libgcc_s",    "libicu"};
  std::set<std::string> users;
  for (const Loaded& library : loaded_libraries()) {
    const auto is_image = [&](const char* prefix) { return library.name.starts_with(prefix); };
    if (std::ranges::any_of(images, is_image)) continue;
    for (const std::string& function : library.imports) {
      const std::string where = defined_in(function.c_str());
      if (where.starts_with("libm.so") && !is_long_or_complex(library.name, function)) {
        EXPECT_TRUE(kExact.contains(function)) << library.name << " calls libm's " << function;
      }
      if (function == "sin" || function == "cos" || function == "atan2" || function == "pow") {
        users.insert(library.name);
        EXPECT_THAT(where, HasSubstr("test_cli")) << function;
      }
    }
  }
  EXPECT_GT(users.size(), 3U) << "the libraries' imports were not found";
}

// --------------------------------------------------------------------- other mathematics

// A copy of a log whose first rates differ in the last bit, and with `mathematics` in its header.
void write_altered(const fs::path& from, const fs::path& to, const std::string& mathematics) {
  auto log = LogReader::open(from.string());
  ASSERT_TRUE(log.has_value()) << log.error();
  LogHeader header = *log->header();
  header.mathematics = mathematics;
  auto copy = LogWriter::create(to.string(), header);
  ASSERT_TRUE(copy.has_value()) << copy.error();
  bool altered = false;
  while (auto tick = log->next()) {
    double& roll = tick->outputs.rates.roll;
    if (!altered && roll != 0.0) {
      roll = std::nextafter(roll, 1.0);
      altered = true;
    }
    ASSERT_TRUE(copy->write(tick->inputs, tick->outputs, tick->truth));
  }
  ASSERT_TRUE(altered);
  ASSERT_TRUE(copy->close());
}

TEST(AnyCpu, AReplayWithOtherMathematicsIsNotADivergence) {
  ASSERT_EQ(dive_anew("run --log a.lcmlog " + shipped("pool1")).status, 0);
  write_altered(own_folder() / "a.lcmlog", own_folder() / "same.lcmlog", mathematics());
  write_altered(own_folder() / "a.lcmlog", own_folder() / "other.lcmlog",
                "sleef-3.9.9/0123456789abcdef");

  const Ran diverges = dive_anew("replay --json same.lcmlog");
  EXPECT_EQ(diverges.status, 1);
  const auto divergence = nlohmann::json::parse(diverges.out);
  EXPECT_THAT(divergence.at("first_divergence").get<std::string>(), HasSubstr("roll"));
  EXPECT_TRUE(divergence.at("mathematics_difference").is_null());

  const Ran other = dive_anew("replay --json other.lcmlog");
  EXPECT_EQ(other.status, 2);
  const auto json = nlohmann::json::parse(other.out);
  EXPECT_FALSE(json.at("identical").get<bool>());
  EXPECT_TRUE(json.at("first_divergence").is_null());
  EXPECT_THAT(json.at("mathematics_difference").get<std::string>(), HasSubstr("roll"));
  EXPECT_EQ(json.at("mathematics").at("log"), "sleef-3.9.9/0123456789abcdef");
  EXPECT_EQ(json.at("mathematics").at("replay"), mathematics());

  const Ran in_words = dive_anew("replay other.lcmlog");
  EXPECT_THAT(in_words.out, HasSubstr("OTHER MATHEMATICS"));
  EXPECT_THAT(in_words.out, ::testing::Not(HasSubstr("DIVERGES")));
  EXPECT_THAT(in_words.out, HasSubstr("sleef-3.9.9/0123456789abcdef"));
}

}  // namespace
}  // namespace dive::mission

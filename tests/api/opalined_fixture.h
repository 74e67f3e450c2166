#pragma once

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "base/unix_socket.h"
#include "config/session_config.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/raw_http.h"
#include "tests/support/temporary_directory.h"

namespace opaline::testing {

/// A real opalined on a free port and a Unix socket in a directory of its own, with stand-ins for
/// the stages' programs (tests/support/fake_stage.cc).
class OpalinedTest : public ::testing::Test {
 protected:
  OpalinedTest() { std::filesystem::create_directories(switches_); }

  std::string program(const std::string& name) const {
    return opaline::testing::named_directory("OPALINE_BIN_DIR").string() + "/" + name;
  }
  std::string fakes() const { return opaline::testing::named_directory("OPALINE_FAKES").string(); }
  std::filesystem::path demo() const {
    return opaline::testing::named_directory("OPALINE_SOURCE_DIR") / "config" / "sim.toml";
  }
  Process::Environment environment() const {
    return {{"OPALINE_SOCKET", socket_.string()},
            {"OPALINE_FAKE_DIR", switches_.string()},
            {"OPALINE_LOCK_DIR", root_.path().string()},
            {"OPALINE_FAKE_STATION", "demo"}};
  }
  std::unique_ptr<Process> spawn(const std::string& name,
                                 std::vector<std::string> arguments,
                                 const std::string& output) const {
    arguments.insert(arguments.begin(), program(name));
    return std::make_unique<Process>(arguments, environment(), root_.path() / output);
  }
  void start(const std::vector<std::string>& more = {}, std::uint16_t at_port = 0) {
    std::vector<std::string> arguments{
        "--sessions", sessions_.string(), "--port", std::to_string(at_port), "--programs", fakes()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    daemon_ = spawn("opalined", arguments, "opalined.out");
    ASSERT_TRUE(eventually([&] { return port() != 0; })) << daemon_->output();
  }
  // Printed as "http://ADDRESS:PORT".
  std::uint16_t port() const {
    const std::string output = daemon_->output();
    const std::size_t scheme = output.find("http://");
    if (scheme == std::string::npos || output.find('\n', scheme) == std::string::npos) return 0;
    return static_cast<std::uint16_t>(std::stoi(output.substr(output.find(':', scheme + 7) + 1)));
  }
  std::string token_file() const {
    const std::filesystem::path file = root_.path() / "token";
    std::ofstream(file) << "0123456789abcdef\n";
    std::filesystem::permissions(file, std::filesystem::perms::owner_read);
    return file.string();
  }
  void turn_on(const std::string& what, const std::string& text = "") const {
    std::ofstream(switches_ / what) << text;
  }
  void turn_off(const std::string& what) const { std::filesystem::remove(switches_ / what); }

  HttpReply ask(const std::string& method,
                const std::string& target,
                const std::string& body = "",
                const std::string& headers = "") const {
    const auto connection = connect_unix(socket_);
    if (!connection) return {};
    return parse_reply(converse(*connection, request_text(method, target, body, headers)));
  }
  HttpReply ask_tcp(const std::string& method,
                    const std::string& target,
                    const std::string& body = "",
                    const std::string& headers = "") const {
    return parse_reply(converse(connect_tcp(port()), request_text(method, target, body, headers)));
  }
  std::string wish() const {
    const auto contents = config::read_contents(demo());
    EXPECT_TRUE(contents) << (contents ? "" : contents.error().message);
    return nlohmann::json{{"session", contents->session_toml},
                          {"rig", contents->rig_toml},
                          {"resolved", contents->resolved_toml}}
        .dump();
  }
  std::string create() const {
    const HttpReply reply = ask("POST", "/v1/sessions", wish());
    EXPECT_EQ(reply.status, 202) << reply.body;
    return reply.status == 202 ? reply.json().value("id", "") : "";
  }
  std::string state_of(const std::string& id) const {
    const nlohmann::json session = ask("GET", "/v1/sessions/" + id).json();
    return session.is_object() ? session.value("state", "") : "";
  }
  bool becomes(const std::string& id, const std::string& state) const {
    return eventually([&] { return state_of(id) == state; });
  }

  TemporaryDirectory root_;
  std::filesystem::path sessions_ = root_.path() / "sessions";
  std::filesystem::path switches_ = root_.path() / "switches";
  std::filesystem::path socket_ = root_.path() / "opalined.sock";
  std::unique_ptr<Process> daemon_;
};

}  // namespace opaline::testing

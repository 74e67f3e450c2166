#include "tests/support/raw_http.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <cctype>
#include <sstream>

namespace opaline::testing {

FileDescriptor connect_tcp(std::uint16_t port) {
  FileDescriptor fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool connected =
      ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  return connected ? std::move(fd) : FileDescriptor();
}

std::string converse(const FileDescriptor& connection, const std::string& bytes) {
  const timeval deadline{10, 0};
  ::setsockopt(connection.get(), SOL_SOCKET, SO_RCVTIMEO, &deadline, sizeof deadline);
  ::setsockopt(connection.get(), SOL_SOCKET, SO_SNDTIMEO, &deadline, sizeof deadline);
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t n =
        ::send(connection.get(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) break;  // refused early: what it answered is still to be read
    sent += static_cast<std::size_t>(n);
  }
  std::string received;
  char buffer[65536];
  for (;;) {
    const ssize_t n = ::recv(connection.get(), buffer, sizeof buffer, 0);
    if (n <= 0) return received;
    received.append(buffer, static_cast<std::size_t>(n));
  }
}

HttpReply parse_reply(const std::string& text) {
  HttpReply reply;
  const std::size_t end = text.find("\r\n\r\n");
  if (!text.starts_with("HTTP/1.1 ") || end == std::string::npos) return reply;
  reply.status = std::stoi(text.substr(9, 3));
  reply.body = text.substr(end + 4);
  std::istringstream head(text.substr(0, end));
  std::string line;
  std::getline(head, line);
  while (std::getline(head, line)) {
    const std::size_t colon = line.find(": ");
    std::string name = line.substr(0, colon);
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (line.ends_with('\r')) line.pop_back();
    reply.headers[name] = colon == std::string::npos ? "" : line.substr(colon + 2);
  }
  return reply;
}

std::string request_text(const std::string& method,
                         const std::string& target,
                         const std::string& body,
                         const std::string& extra_headers) {
  const bool has_host = extra_headers.starts_with("Host:");
  return fmt::format(
      "{} {} HTTP/1.1\r\n{}{}Connection: close\r\nContent-Type: application/json\r\n"
      "Content-Length: {}\r\n\r\n{}",
      method,
      target,
      has_host ? "" : "Host: localhost\r\n",
      extra_headers,
      body.size(),
      body);
}

}  // namespace opaline::testing

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace chase::link {

using Bytes = std::vector<uint8_t>;

struct Message {
  std::string channel;
  Bytes bytes;
};

class Unpacker;

/// Messages into datagrams that no radio has to cut: small ones share one, large ones take several
/// parts and one of parity, from which any one that is lost is restored.
/// Packet: "CHL2", session (8 bytes), the newest one heard of the other end (8), number (4),
/// records; all big-endian. Record: message (4), part and parts (2 each), length of the channel's
/// name (1), of the bytes (2), the name, the bytes. Of n parts all but the last are of kPartBytes;
/// number n is parity: the length of the last (2), and the exclusive or of all, the last filled up
/// with zeros.
class Packer {
 public:
  static constexpr size_t kMostBytes = 1300;  ///< of a packet, with room for a seal below 1400
  static constexpr size_t kMostName = 64;     ///< of a channel
  static constexpr size_t kPartBytes = kMostBytes - 24 - 11 - 2 - kMostName;
  static constexpr size_t kMostParts = 200;  ///< larger messages are left out

  /// `session`: grows from start to start of this side; where its clock went back, Hear mends it.
  explicit Packer(int64_t session) : session_(session) {}

  /// What came from the other end: our packets say which of its sessions was heard, and one of ours
  /// that it knows to be newer than this is outbid.
  void Hear(const Unpacker& other);

  /// False where the message is too large, or its channel's name is.
  bool Add(const std::string& channel, const uint8_t* data, size_t size);
  /// Packets to send now, in order; `idle`: one even where there is nothing to say.
  std::vector<Bytes> Take(bool idle);

 private:
  void AddPart(const std::string& channel, const uint8_t* data, size_t size, size_t part,
               size_t parts);
  void Begin();

  int64_t session_, heard_ = 0;
  uint32_t next_packet_ = 0, next_message_ = 0;
  Bytes current_;
  std::vector<Bytes> full_;
};

/// Packets into messages, whatever the path did to them: lost, doubled, in another order, forged.
class Unpacker {
 public:
  /// Appends the messages that this packet completes; false where it is none of ours or older than
  /// the session at hand.
  bool Take(const uint8_t* data, size_t size, std::vector<Message>* messages);
  /// Was the last packet newer than all before? Any other may be a recording of its sender's.
  bool advanced() const { return advanced_; }

  /// The newest session of the other end, and the newest of ours that it has heard; 0: none.
  int64_t session() const { return session_; }
  int64_t heard() const { return heard_; }
  int64_t packets() const { return packets_; }
  int64_t lost() const { return lost_; }

 private:
  struct Open {
    std::string channel;
    std::vector<Bytes> parts;  ///< and parity
    size_t missing = 0;        ///< one may be
  };
  struct Record;

  bool Follows(int64_t session, uint32_t number);
  void Accept(const Record& record, std::vector<Message>* messages);
  bool IsDone(uint32_t message) const { return done_.count(message) > 0; }
  void Finish(uint32_t message);

  int64_t session_ = 0, heard_ = 0;
  uint32_t next_ = 0;
  bool advanced_ = false;
  int64_t packets_ = 0, lost_ = 0;
  std::set<int64_t> missing_;  // that may still come
  std::map<uint32_t, Open> open_;
  std::set<uint32_t> done_;
  std::deque<uint32_t> done_order_;
};

}  // namespace chase::link

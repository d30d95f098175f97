#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/viewer/foxglove_protocol.h"

namespace chase::viewer {
namespace {

using nlohmann::json;

TEST(ViewerFoxglove, Base64) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe"), "//4=");
}

TEST(ViewerFoxglove, SubscribesAndLetsGo) {
  const Parameters parameters = {{"version", "1"}, {"source", "live"}};
  FoxgloveClient client(&parameters);
  EXPECT_EQ(client.Hear(R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":7}]})"), "");
  EXPECT_EQ(client.channels().at(0), 7U);
  EXPECT_EQ(client.Hear(R"({"op":"unsubscribe","subscriptionIds":[0]})"), "");
  EXPECT_TRUE(client.channels().empty());
  const json all =
      json::parse(client.Hear(R"({"op":"getParameters","parameterNames":[],"id":"a"})"));
  EXPECT_EQ(all["parameters"].size(), 2U);
  EXPECT_EQ(all["id"], "a");
  const json refused = json::parse(client.Hear(R"({"op":"setParameters","parameters":[]})"));
  EXPECT_EQ(refused["op"], "status");
}

TEST(ViewerFoxglove, GarbageIsAnsweredAndBounded) {
  const Parameters none;
  FoxgloveClient client(&none);
  for (const char* text :
       {"", "x", "[]", R"({"op":1})", R"({"op":"subscribe","subscriptions":[{"id":-1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99999999999}]})"})
    EXPECT_EQ(json::parse(client.Hear(text))["op"], "status") << text;
  EXPECT_EQ(client.Hear(R"({"op":"subscribe","subscriptions":7})").empty(), false);
  for (int i = 0; i < 1000; ++i)
    client.Hear(R"({"op":"subscribe","subscriptions":[{"id":)" + std::to_string(i) +
                R"(,"channelId":1}]})");
  EXPECT_EQ(client.channels().size(), FoxgloveClient::kMostSubscriptions);
}

TEST(ViewerFoxglove, MessageData) {
  const std::string bytes = MessageData(0x01020304, 5, "payload");
  EXPECT_EQ(bytes.substr(0, 5), std::string("\1\4\3\2\1", 5));
  EXPECT_EQ(bytes.substr(5, 8), std::string("\x88\x13\0\0\0\0\0\0", 8));  // 5000 ns
  EXPECT_EQ(bytes.substr(13), "payload");
}

TEST(ViewerFoxglove, TheServiceIsOfferedAndCalled) {
  EXPECT_EQ(json::parse(ServerInfoText("chase", "1", false))["capabilities"],
            json::array({"parameters"}));
  const json info = json::parse(ServerInfoText("chase", "1", true));
  EXPECT_EQ(info["capabilities"], json::array({"parameters", "services"}));
  EXPECT_EQ(info["supportedEncodings"], json::array({"json"}));
  const json service = json::parse(AdvertiseServiceText())["services"][0];
  EXPECT_EQ(service["name"], "command");
  EXPECT_TRUE(
      json::parse(std::string(service["request"]["schema"]))["properties"].contains("token"));
  const std::string head("\2\1\0\0\0\7\0\0\0\4\0\0\0json", 17), text = R"({"command":"land"})";
  ASSERT_TRUE(ServiceCallOf(head + text));
  EXPECT_EQ(ServiceCallOf(head + text)->call, 7U);
  EXPECT_EQ(ServiceCallOf(head + text)->payload, text);
  EXPECT_EQ(ServiceCallOf(head)->payload, "");
  for (size_t i = 0; i < head.size(); ++i) {
    EXPECT_FALSE(ServiceCallOf(head.substr(0, i))) << i;
    std::string other = head;
    other[i] = 'x';
    EXPECT_EQ(ServiceCallOf(other).has_value(), i >= 5 && i < 9) << i;  // but for the call's number
  }
  const std::string answer = CommandAnswer(7, "wrong token", "");
  EXPECT_EQ(answer.substr(0, 17), "\3" + head.substr(1));
  EXPECT_EQ(json::parse(answer.substr(17)), json({{"accepted", false}, {"words", "wrong token"}}));
  EXPECT_EQ(json::parse(CommandAnswer(7, "", "lands").substr(17))["accepted"], true);
  EXPECT_EQ(json::parse(CallFailureText({7, "x"}))["callId"], 7);
}

}  // namespace
}  // namespace chase::viewer

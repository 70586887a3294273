// An uploaded file has arrived, no more: whether it can be used is said by the server.
const received = new MutationObserver(() => {
  for (const text of document.querySelectorAll(".mantine-Notification-description")) {
    if (text.textContent === "File uploaded successfully.") text.textContent = "Received. Reading it now.";
  }
});
received.observe(document.body, { childList: true, subtree: true, characterData: true });

document.title = "Bunraku";

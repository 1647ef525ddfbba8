"""What is generated from the program's card table: the manual's page of cards, grammars for editors; and the manual as a site and a book."""
